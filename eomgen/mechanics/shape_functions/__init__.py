"""Shape functions of beams and their integrals, correctly rounded and identical on every machine."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["integrals", "shape_integrals"]
