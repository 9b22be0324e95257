"""Files of Hamiltonian systems: H by formulas of coordinates, momenta and parameters, read and checked."""

__all__ = ["document", "fields", "json_schema"]
#: Open to the other parts of ``products.fields`` as well.
WITHIN = ["cells", "field_reading", "reading"]
