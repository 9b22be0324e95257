"""Files of Hamiltonian systems: H by formulas of coordinates, momenta and parameters, read and checked."""

__all__ = []
#: Open to the other parts of ``products.fields`` as well.
WITHIN = ["document", "entries", "field_reading", "reading", "recording", "tables"]
