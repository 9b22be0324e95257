"""Formulas as text: scopes, tokens, parser, names of included files."""

__all__ = ["definitions", "namespaces", "scope", "tokens"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["parser"]
