"""Derivatives of whole runs, consistent with the discrete steps: tangents, adjoints, their functionals."""

from eomgen.base.products import Product

__all__ = ["linearise"]

PRODUCT = Product()
#: Open to the other parts of ``products`` as well.
WITHIN = ["crossings", "functionals", "run_sensitivities", "stationary_run"]
