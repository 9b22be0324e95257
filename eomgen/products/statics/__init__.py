"""Statics: load paths with their critical points, linear buckling loads, and steady motions."""

from eomgen.base.products import Product
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
                parts={"equilibrium": "eomgen.products.statics.command:LoadPaths"},
            ),
            Verb("steady_motion", methods=("eomgen.products.statics.steady_motion:steady_motion",), behind="save"),
        ),
    },
    moved={
        "analysis.path_following": "eomgen.products.statics.path_following",
        "analysis.equilibrium_path": "eomgen.products.statics.equilibrium_path",
        **{
            f"analysis.{name}": f"eomgen.products.statics.{name}"
            for name in ("steady_conditions", "steady_motion", "steady_search", "symmetries")
        },
        "solvers.critical_points": "eomgen.products.statics.critical_points",
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["path_following", "steady_motion", "symmetries"]
