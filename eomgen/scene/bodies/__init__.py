"""Rigid bodies and beams: what the user writes, and what they become."""
