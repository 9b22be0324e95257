"""Rotations and mass properties as numbers; knows nothing of scenes."""
