"""Formulas as small trees: words, scopes, tokens, parser, evaluation, where they jump or bend."""

__all__ = ["discontinuities", "evaluate", "nodes", "piecewise"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["namespaces", "scope", "tokens"]
