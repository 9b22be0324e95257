"""Shape functions of beams and their integrals, exact to the last digit on every machine."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["integrals", "shape_integrals"]
