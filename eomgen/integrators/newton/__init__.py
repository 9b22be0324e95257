"""The linear systems of implicit steps: sparse matrices, their order of elimination, its stages and fronts."""
