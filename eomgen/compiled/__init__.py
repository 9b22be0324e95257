"""A compiled library as a model of functions on NumPy arrays: arguments, coordinates, terms, consistent states."""

__all__ = [
    "argument_derivatives",
    "arguments",
    "beams",
    "consistent_states",
    "constraints",
    "coordinates",
    "corrected_start",
    "equations",
    "functions",
    "initial_state",
    "lanes",
    "model",
    "prescribed",
    "requirements",
    "saving",
    "section_loads",
    "state",
    "terms",
]
