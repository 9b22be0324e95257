"""Contract tests for authors of other distributions: force elements, joint types, integrators, laws; as
``eomgen.testing``."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(modules={"testing": "eomgen.products.testing.contracts"}, needs=("pictures",))
#: Open to the other parts of ``products`` as well.
WITHIN = ["contracts"]
