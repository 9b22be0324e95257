"""A compiled library as a model of functions on NumPy arrays: arguments, coordinates, terms, consistent states."""

__all__ = [
    "argument_derivatives",
    "arguments",
    "base_parameters",
    "beams",
    "consistent_states",
    "constraints",
    "coordinates",
    "equations",
    "functions",
    "initial_state",
    "model",
    "prescribed",
    "rest",
    "saving",
    "terms",
]
