"""URDF, SDF and MJCF as sources; their readers are imported for the first file of their format."""

from __future__ import annotations

from functools import partial
from typing import Any

from eomgen.base.products import import_target
from eomgen.scene.sources.source import ACTUATED, FRICTION, LIMITS, LOCK, ConvertedScene, Option, Source


def read_by(reader: str, text: str, **options: Any) -> ConvertedScene:
    """Return a file in the form of a scene file by the function ``module:function`` below this room, with its
    options."""
    read: Any = import_target(f"eomgen.products.robots.{reader}")
    scene: ConvertedScene = read(text, **options)
    return scene


URDF = Source(
    "URDF",
    (".urdf", ".xml"),
    "a .urdf file",
    partial(read_by, "urdf.conversion:urdf_data"),
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
            ("fixed_base", "use_fixed_base", "fix_base"), 'root="fixed" or "free"; of SDF weld="base_link"'
        ),
        **dict.fromkeys(("free_flyer", "root_joint", "floating_base", "floating"), 'root="free"'),
    },
    recorded=True,
)
WELD = Option(
    "weld",
    (),
    "fix this link or frame to the base at its place; may be repeated",
    metavar="LINK",
    of_key="links and frames that are fixed to the base at their places",
    elsewhere="a fixed joint in the scene file",
)
PACKAGES = Option(
    "packages",
    (),
    "folder of a package or model that the file names, NAME=FOLDER; may be repeated",
    metavar="NAME=FOLDER",
    of_key="folders of packages and models that the file names, each as NAME=FOLDER",
    elsewhere="paths from the folder of the scene file",
)
SDF = Source(
    "SDF",
    (".sdf", ".world", ".xml"),
    "an .sdf file",
    partial(read_by, "sdf.conversion:sdf_data"),
    (LOCK, LIMITS, FRICTION, ACTUATED, WELD, PACKAGES),
    elsewhere=dict.fromkeys((".yaml", ".yml"), "[include.NAME] of each model that Drake adds, in a scene file"),
    root="sdf",
    recorded=True,
    located=True,
)
MJCF = Source(
    "MJCF",
    (".xml", ".mjcf"),
    "an .xml file of MuJoCo",
    partial(read_by, "mjcf.conversion:mjcf_data"),
    (
        LIMITS,
        FRICTION,
        Option(
            "keyframe",
            "",
            "start from this keyframe",
            metavar="KEY",
            of_key="the initial state is this keyframe",
            elsewhere="`initial` of the joints in the scene file",
        ),
        Option(
            "mocap",
            False,
            "move mocap bodies by motions from outside, NAME_x to NAME_roll",
            of_key="motions from outside move mocap bodies",
            elsewhere="`drive` of joints with `motion` inputs in the scene file",
        ),
    ),
    root="mujoco",
    located=True,
)
