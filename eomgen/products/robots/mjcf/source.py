"""MJCF as a source."""

from __future__ import annotations

from pathlib import Path

from eomgen.scene.sources.source import FRICTION, LIMITS, ConvertedScene, Option, Source


def read_mjcf(
    text: str,
    *,
    file: str = "model.xml",
    strict: bool = False,
    included: bool = False,
    path: Path | None = None,
    limits: bool = False,
    friction: bool = False,
    keyframe: str = "",
    mocap: bool = False,
) -> ConvertedScene:
    """Return an MJCF file in the form of a scene file; the options as in ``MJCF``.

    Parameters
    ----------
    path : Path, optional
        The file, from whose folder included files and meshes are read.

    Raises
    ------
    DescriptionError, OptionError, UsageError
    """
    from eomgen.products.robots.mjcf.conversion import mjcf_data  # noqa: PLC0415  # most scenes are not MJCF

    return mjcf_data(
        text,
        file=file,
        strict=strict,
        path=path,
        limits=limits,
        friction=friction,
        keyframe=keyframe,
        mocap=mocap,
        included=included,
    )


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
