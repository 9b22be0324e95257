"""Comparison of two descriptions of one machine, or of a description with another program's reading."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    names={
        "Comparison": "eomgen.products.comparison.report:Comparison",
        "compare": "eomgen.products.comparison.compare:compare",
    },
    rows={
        "eomgen.removed": ({"attribute": {"Difference.cause": "first and second, the two values"}},),
        "eomgen.verbs": (
            Verb(
                "compare",
                "Compare two descriptions of one machine; name the first difference.",
                "eomgen.products.comparison.command:compare",
                behind="info",
                heading="Import and export",
            ),
        ),
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["compare", "report"]
