"""Names that products offer to users, by product, for messages if one is not installed; written by
``python -m tests.product_names eomgen/products/offered.py``."""

from __future__ import annotations

OFFERED: dict[str, tuple[str, ...]] = {
    "comparison": ("Comparison", "compare"),
    "derivatives": ("sensitivities",),
    "ensembles": ("ensemble", "simulate_many"),
    "fields": ("fields", "hamiltonian", "sample", "sampling"),
    "fmu": ("fmu",),
    "laws": ("law", "laws"),
    "maps": ("map", "maps"),
    "optimisers": ("acados", "casadi", "jax", "torch"),
    "pages": ("latex", "live", "report"),
    "pictures": ("animate", "plot_sections", "rainflow"),
    "reliability": ("RandomVibration", "random", "random_vibration"),
    "robots": (".mjcf", ".sdf", ".urdf", ".world", ".xml", "MJCF", "SDF", "URDF"),
    "statics": ("buckling_loads", "equilibrium_path"),
    "studies": (
        "Extremes",
        "Identification",
        "RealTime",
        "Tradeoff",
        "Tuned",
        "check",
        "extremes",
        "identify",
        "savings",
        "studies",
        "tradeoff",
        "tune",
    ),
    "sympy_mechanics": ("from_sympy",),
    "testing": ("testing",),
    "waves": ("base.follow", "elevation", "hulls", "slope", "water_acceleration", "water_velocity", "waves"),
}
