"""Derivatives of whole runs, consistent with the discrete steps: tangents, adjoints, their functionals."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={"eomgen.verbs": (Verb("sensitivities", methods=("eomgen.products.derivatives.linearise:sensitivities",)),)}
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["crossings", "functionals", "linearise", "run_sensitivities", "stationary_run", "steps"]
