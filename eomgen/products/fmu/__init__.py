"""FMUs: models as units of the Functional Mock-up Interface, versions 2.0 and 3.0, as source and compiled."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    names={"fmu": "eomgen.products.fmu.export:fmu"},
    rows={
        "eomgen.verbs": (
            Verb(
                "fmu",
                "Write a model for other simulation tools: FMI 2.0 or 3.0.",
                "eomgen.products.fmu.command:fmu",
                behind="generate",
                heading="Import and export",
            ),
        ),
    },
)
#: Open to all parts of ``products``.
WITHIN = ["export"]
