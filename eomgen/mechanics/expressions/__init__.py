"""Formulas and curves of a scene, recorded on the tape."""
