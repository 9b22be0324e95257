"""SDF as a source."""

from __future__ import annotations

from typing import Any

from eomgen.scene.sources.source import ACTUATED, FRICTION, LIMITS, LOCK, ConvertedScene, Option, Source


def read_sdf(text: str, **options: Any) -> ConvertedScene:
    """Return an SDF file in the form of a scene file; the options as of ``sdf_data``."""
    from eomgen.products.robots.sdf.conversion import sdf_data  # noqa: PLC0415  # most scenes are not SDF

    return sdf_data(text, **options)


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
    (LOCK, LIMITS, FRICTION, ACTUATED, WELD, PACKAGES),
    elsewhere=dict.fromkeys(
        (".yaml", ".yml"), "[include.NAME] of each model in a scene file: directives of Drake are not read"
    ),
    root="sdf",
    recorded=True,
    located=True,
)
