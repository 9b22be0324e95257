"""Files of Hamiltonian systems: H by formulas of coordinates, momenta and parameters, read and checked."""

__all__ = []
#: Open to the other parts of ``products.fields`` as well.
WITHIN = ["cells", "document", "field_reading", "fields", "json_schema", "reading"]
