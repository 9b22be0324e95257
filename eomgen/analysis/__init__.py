"""Analyses of a compiled model about one state: equilibria, steady motions, linear models, root loci."""
