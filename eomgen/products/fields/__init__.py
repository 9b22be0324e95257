"""Hamiltonian systems: their files, models and motions; fields on meshes, and samples of their posteriors."""

from eomgen.base.products import Product

__all__ = ["documents", "front_end", "hamiltonian", "sampling"]

PRODUCT = Product(
    modules={"fields": "eomgen.products.fields.posteriors", "sampling": "eomgen.products.fields.sampling"},
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["posteriors"]
