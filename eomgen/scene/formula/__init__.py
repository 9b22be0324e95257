"""Formulas as text: scopes, tokens, parser, names of included files."""

__all__ = ["namespaces", "parser", "scope", "tokens"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["definitions"]
