"""Constraint equations: rows, their rates and partials; joints between absolute bodies; counted angles."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["counted_angles", "joint_velocities", "joints", "rows"]
