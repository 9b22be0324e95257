"""SDF as a source."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from eomgen.scene.sources.source import ACTUATED, FRICTION, LIMITS, LOCK, ConvertedScene, Option, Source


def read_sdf(
    text: str,
    *,
    file: str = "model.sdf",
    strict: bool = False,
    included: bool = False,
    path: Path | None = None,
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    actuated: bool = False,
    weld: Sequence[str] = (),
    packages: Sequence[str] = (),
) -> ConvertedScene:
    """Return an SDF file in the form of a scene file; the options as in ``SDF``.

    Parameters
    ----------
    path : Path, optional
        The file, from whose folder included files are read.

    Raises
    ------
    DescriptionError, OptionError
    """
    from eomgen.products.robots.sdf.conversion import sdf_data  # noqa: PLC0415  # most scenes are not SDF

    return sdf_data(
        text,
        file=file,
        strict=strict,
        path=path,
        lock=lock,
        limits=limits,
        friction=friction,
        actuated=actuated,
        weld=weld,
        packages=packages,
        included=included,
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
    read_sdf,
    (
        LOCK,
        LIMITS,
        FRICTION,
        ACTUATED,
        WELD,
        PACKAGES,
    ),
    elsewhere=dict.fromkeys(
        (".yaml", ".yml"), "[include.NAME] of each model in a scene file: directives of Drake are not read"
    ),
    root="sdf",
    recorded=True,
    located=True,
)
