"""Suspensions on a test rig: kinematics and compliance of an axle over travel, steering and loads."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    names={
        "SuspensionCurves": "eomgen.products.suspension.result:SuspensionCurves",
        "suspension": "eomgen.products.suspension.study:suspension",
    },
    rows={
        "eomgen.verbs": (
            Verb(
                "suspension",
                "Kinematics and compliance of an axle: tables, plots, a page.",
                "eomgen.products.suspension.command:suspension",
                behind="identify",
                heading="Studies",
            ),
        ),
    },
    needs=("pictures",),
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["result", "study"]
