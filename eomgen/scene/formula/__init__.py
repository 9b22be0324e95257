"""Formulas as text: scopes, tokens, parser, names of included files."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["namespaces", "parser", "scope", "tokens"]
