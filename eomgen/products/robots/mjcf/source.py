"""MJCF as a source."""

from __future__ import annotations

from typing import Any

from eomgen.scene.sources.source import FRICTION, LIMITS, ConvertedScene, Option, Source


def read_mjcf(text: str, **options: Any) -> ConvertedScene:
    """Return an MJCF file in the form of a scene file; the options as of ``mjcf_data``."""
    from eomgen.products.robots.mjcf.conversion import mjcf_data  # noqa: PLC0415  # most scenes are not MJCF

    return mjcf_data(text, **options)


MJCF = Source(
    "MJCF",
    (".xml", ".mjcf"),
    "an .xml file of MuJoCo",
    read_mjcf,
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
