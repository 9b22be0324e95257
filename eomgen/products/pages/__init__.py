"""Pages: scenes that run in a web page without a server, reports on runs, and equations as LaTeX documents."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "live",
                "Write a page in which the model runs, with sliders and plots.",
                "eomgen.products.pages.commands:live",
                ("eomgen.products.pages.live:live",),
                behind="animate",
                heading="Build and run",
            ),
            Verb(
                "report",
                "Write one page on scenes and runs: counts, findings, plots, modes.",
                "eomgen.products.pages.commands:report",
                ("eomgen.products.pages.report:report",),
                behind="live",
                heading="Build and run",
            ),
            Verb(
                "latex",
                "Write the equations of motion as a LaTeX document.",
                "eomgen.products.pages.commands:latex",
                behind="generate",
                heading="Import and export",
            ),
        )
    },
    needs=("pictures", "studies"),
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["live", "report"]
