"""Maps: tables of two arguments in formulas, as torques of a motor over speed and voltage, or heights of terrain."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.sections": (LateRow("maps", "eomgen.products.maps.section:MAPS", behind="curves"),),
        "eomgen.formula_words": ("eomgen.products.maps.surface:MAP",),
    },
)
