"""Scenes from texts of URDF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from eomgen.products.robots.urdf.source import URDF
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.scene.sources.register import checked_options


def load_urdf(
    text: str,
    *,
    file: str = "robot.urdf",
    strict: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    task_frames: Sequence[str] = (),
    **options: Any,
) -> Scene:
    """Return a scene from the text of a URDF file; arguments as of ``eomgen.load``."""
    read = URDF.read(text, file=file, strict=strict, **checked_options(URDF, options))
    data = {**read.data, "task_frames": list(task_frames)} if task_frames else read.data
    return from_data(
        data,
        file=file,
        lines=read.lines,
        notes=read.notes,
        inertias_checked=read.inertias_checked,
        coordinates=coordinates,
    )
