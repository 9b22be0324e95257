"""Equations of SymPy's mechanics as models: systems of joints, Kane's and Lagrange's methods, matrices."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(names={"from_sympy": "eomgen.products.sympy_mechanics.reading:from_sympy"})
#: Open to the other parts of ``products`` as well.
WITHIN = ["reading"]
