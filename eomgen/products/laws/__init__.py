"""Laws: functions of a scene's own C files in formulas, as tyre forces or aerodynamic coefficients."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.sections": (LateRow("laws", "eomgen.products.laws.section:LAWS", behind="maps"),),
        "eomgen.formula_words": ("eomgen.products.laws.law:LAW",),
        "eomgen.keys_elsewhere": ("eomgen.products.laws.section:ELSEWHERE",),
        "eomgen.info": ("eomgen.products.laws.info:INFO",),
    },
)
