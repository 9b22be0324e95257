"""Files of Hamiltonian systems: H by formulas of coordinates, momenta and parameters, read and checked."""

__all__ = ["cells", "document", "field_reading", "fields", "json_schema", "reading"]
