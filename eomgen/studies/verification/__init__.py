"""Checks of all closed forms of a scene by differences, complex steps and second derivations."""
