"""Statics: load paths with their critical points, and linear buckling loads."""

from eomgen.base.products import LateRow, Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "equilibrium_path",
                methods=(
                    "eomgen.products.statics.path_following:equilibrium_path",
                    "eomgen.products.statics.path_following:buckling_loads",
                ),
                behind="completion",
            ),
        ),
        "eomgen.statics": (LateRow("path", "eomgen.products.statics.command:PathRequest"),),
    },
    moved={
        "analysis.path_following": "eomgen.products.statics.path_following",
        "analysis.equilibrium_path": "eomgen.products.statics.equilibrium_path",
        "solvers.critical_points": "eomgen.products.statics.critical_points",
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["path_following"]
