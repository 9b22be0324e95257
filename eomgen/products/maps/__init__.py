"""Maps: tables of two arguments in formulas, as torques of a motor over speed and voltage, or heights of terrain."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.sections": ("eomgen.products.maps.section:MAPS",),
        "eomgen.formula_words": ("eomgen.products.maps.surface:MAP",),
    },
)
