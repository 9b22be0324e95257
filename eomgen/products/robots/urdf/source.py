"""URDF as a source."""

from __future__ import annotations

from typing import Any

from eomgen.scene.sources.source import ACTUATED, FRICTION, LIMITS, LOCK, ConvertedScene, Option, Source


def read_urdf(text: str, **options: Any) -> ConvertedScene:
    """Return a URDF in the form of a scene file; the options as of ``urdf_data``."""
    from eomgen.products.robots.urdf.conversion import urdf_data  # noqa: PLC0415  # most scenes are not URDF

    return urdf_data(text, **options)


URDF = Source(
    "URDF",
    (".urdf", ".xml"),
    "a .urdf file",
    read_urdf,
    (
        Option(
            "root",
            "fixed",
            "how the root link is held",
            choices=("fixed", "free"),
            of_key="mounting of the root link: fixed to the parent, or free",
        ),
        LOCK,
        LIMITS,
        FRICTION,
        ACTUATED,
        Option(
            "transmissions",
            False,
            "make efforts of actuators with transmissions inputs",
            of_key="efforts of actuators with transmissions are inputs",
            elsewhere="[inputs], and [efforts] that multiply them by reductions, in the scene file",
        ),
        Option(
            "tunable",
            (),
            "make mass, centre of mass and inertia of this link tunable parameters; may be repeated",
            metavar="LINK",
            of_key="links whose mass, centre of mass and inertia are tunable parameters",
            elsewhere="tunable [parameters] in the scene file, and formulas of them for mass and inertia",
        ),
    ),
    {".xacro": "xacro first, to make a .urdf of it"},
    {
        **dict.fromkeys(
            ("fixed_base", "use_fixed_base", "fix_base"), 'root="fixed", or root="free"; of SDF weld="base_link"'
        ),
        **dict.fromkeys(("free_flyer", "root_joint", "floating_base", "floating"), 'root="free"'),
    },
    recorded=True,
)
