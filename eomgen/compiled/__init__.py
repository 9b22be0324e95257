"""A compiled library as a model of functions on NumPy arrays: arguments, coordinates, terms, consistent states."""
