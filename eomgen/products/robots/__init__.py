"""Robots: models of URDF, SDF and MJCF as scenes."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.attributes": ("eomgen.products.robots.other_words:ATTRIBUTES",),
        "eomgen.sources": (
            "eomgen.products.robots.sources:URDF",
            "eomgen.products.robots.sources:MJCF",
            "eomgen.products.robots.sources:SDF",
        ),
    },
)
