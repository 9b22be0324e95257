"""Terms that are recorded on request: forward dynamics, implicit steps, linear models, rates."""

__all__ = ["rates"]
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["recorders"]
