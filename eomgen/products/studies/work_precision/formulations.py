"""Formulations of one scene: joint coordinates, and absolute ones with bodies on SE(3) or on R^3 x SO(3)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from eomgen.errors import EomgenError
from eomgen.pipeline import pipeline
from eomgen.products.studies.work_precision.fidelity import simplified
from eomgen.scene.load import load as load_file
from eomgen.scene.scene import Scene

JOINT = "joint"
#: Groups on which absolute bodies move, the one of bodies that name none first.
GROUPS = ("SE3", "R3xSO3")


@dataclass(frozen=True)
class Formulations:
    """Formulations of a scene.

    Attributes
    ----------
    scenes : by name, the scene's own first
    refused : reasons for which others are missing, by name
    simplified : names of formulations of less fidelity
    """

    scenes: Mapping[str, Any]
    refused: Mapping[str, str]
    simplified: tuple[str, ...] = ()

    @property
    def own(self) -> str:
        """The name of the scene's own formulation."""
        return next(iter(self.scenes))


def formulations(described: Any, options: Mapping[str, Any], *, others: bool, fidelity: bool = False) -> Formulations:
    """Return the formulations of a source of ``eomgen.load``.

    A Scene that was made already keeps its coordinates, since they are chosen when it is read.

    Parameters
    ----------
    options : of ``eomgen.load``
    others : whether formulations besides the scene's own are wanted
    fidelity : whether its own one is also wanted with less fidelity

    Raises
    ------
    EomgenError
        As of ``eomgen.load``, for the scene as it is.
    """
    from_text = isinstance(described, str | os.PathLike | Mapping)
    own = pipeline.load_scene(described, **options) if from_text else pipeline.as_document(described)[0]
    if not isinstance(own, Scene):
        return Formulations({"as given": own}, {})
    result, refused = {_name_of(own): own}, {}
    for coordinates in ("joint", "absolute") if others else ():
        if coordinates != own.coordinates and not from_text:
            continue
        try:
            scene = own if coordinates == own.coordinates else _read(described, options, coordinates)
        except EomgenError as error:
            refused[coordinates] = "; ".join(problem.what for problem in error.problems) or str(error)
            continue
        for changed in [scene] if coordinates == "joint" else [_on_group(scene, group) for group in GROUPS]:
            result.setdefault(_name_of(changed), changed)
    less = {f"{_name_of(own)}, {change}": scene for change, scene in simplified(own)} if fidelity else {}
    return Formulations({**result, **less}, refused, tuple(less))


def _read(described: Any, options: Mapping[str, Any], coordinates: Literal["joint", "absolute"]) -> Scene:
    given = {**options, "coordinates": coordinates}
    return (
        pipeline.load_scene(described, **given)
        if isinstance(described, Mapping)
        else load_file(Path(described), **given)
    )


def _on_group(scene: Scene, group: str) -> Scene:
    """Return an absolute scene all of whose bodies move on one group."""
    groups = {body.name: group for body in scene.bodies}
    return scene if _groups(scene) == {group} else replace(scene, groups=groups)


def _groups(scene: Scene) -> set[str]:
    return {scene.groups.get(body.name, GROUPS[0]) for body in scene.bodies}


def _name_of(scene: Scene) -> str:
    if scene.coordinates == "joint":
        return JOINT
    groups = _groups(scene)
    return next(iter(groups)) if len(groups) == 1 else "absolute, mixed groups"
