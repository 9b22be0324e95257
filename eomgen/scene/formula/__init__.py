"""Formulas as small trees: words, scopes, tokens, parser, evaluation, where they jump or bend."""
