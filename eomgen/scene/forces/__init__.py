"""Forces and force elements, a module for each kind with schema, model and reading."""

__all__ = ["bushings", "efforts", "element", "forces", "springs", "torsion_springs", "tyres"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["register"]
