"""Formulas as text: scopes, tokens, parser, names of included files."""

__all__ = ["definitions", "namespaces", "parser", "scope", "tokens"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["parser"]
