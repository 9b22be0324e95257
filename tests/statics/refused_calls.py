"""Refused calls of statics from Python with their texts, and calls at the border that are taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import eomgen
from eomgen.products.statics.command import LoadPaths


def rest_options(**given: object) -> dict[str, Any]:
    """Return options of ``eomgen equilibrium``."""
    return {"along": None, "over": (), "figure": None, "buckling": None, "path": None, **given}


def pushed() -> eomgen.Model:
    """Return a mass on a line that an input pushes, beside a driven wheel."""
    builder = eomgen.SceneBuilder("pushed").body("mass", 1.0).input("push", unit="N")
    builder.body("wheel", 1.0).joint("hinge", "revolute", "base", "wheel", axis=[0, 0, 1], drive="2 * t")
    builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=1.0).effort("drive", "slide", "push")
    return eomgen.build(builder.build(), profile="instant")


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "drives": (
        lambda: pushed().steady_motion({"hinge": 2.001}),
        "velocity hinge: it is driven at 2 rad/s, and 2.001 rad/s is given; try: a tunable parameter in the law,"
        ' drive = "w*t", and the value as that parameter\'s; or no drive',
    ),
    "over without path": (
        lambda: LoadPaths(rest_options(over=("x",))),
        "--over: it belongs to a path; try: --path load=0:10",
    ),
    "buckling and figure": (
        lambda: LoadPaths(rest_options(figure="a.png", buckling="load")),
        "--plot: it belongs to a path, or to an equilibrium alone; try: --path load=0:10",
    ),
    "a path over an input of a list": (
        lambda: pushed().equilibrium_path("push", 1.0, u=[0.0]),
        "u: push is varied, so the other inputs are given by name; try: u={...}",
    ),
    "path and buckling": (
        lambda: LoadPaths(rest_options(along="load=0:10", buckling="load")),
        "--buckling: it is asked for together with --path; try: one of them",
    ),
}
ACCEPTED: Sequence[Callable[[], object]] = (lambda: LoadPaths(rest_options(figure="a.png")).answers,)
