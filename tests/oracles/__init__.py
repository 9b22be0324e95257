"""Independent ways to the same numbers: other engines, other algorithms, other derivatives."""
