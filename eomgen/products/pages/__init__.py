"""Pages: scenes that run in a web page without a server, and reports on runs."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = ["live"]

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "live",
                "Write a page in which the model runs, with sliders and plots.",
                "eomgen.products.pages.commands:live",
                ("eomgen.products.pages.live:live",),
                behind="animate",
            ),
        )
    },
)
