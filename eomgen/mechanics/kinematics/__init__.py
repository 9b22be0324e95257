"""Motion of bodies and points: velocity and acceleration fields, positions, directions, Jacobians."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["bodies", "directions", "fields", "points"]
