"""Joints, their frames, limits and followers, and constraints: what the user writes, and what they become."""
