"""Time derivatives of generalized forces and accelerations, by recursion, by jets and in closed form."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["closed_form", "jets", "recursion"]
