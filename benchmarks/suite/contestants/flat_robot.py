"""A robot on a fixed base, as numbers joint by joint (``native/read_model.hpp``), written as URDF for peers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Link:
    """A hinge and the body it carries; the inertia is (3, 3) about the center of mass in axes of the body."""

    parent: int
    axis: Any
    rotation: Any
    position: Any
    mass: float
    center: Any
    inertia: Any


def read(file: str) -> list[Link]:
    """Return the links, parents first. Raises ValueError for joints that are no hinges."""
    links = []
    for line in Path(file).read_text(encoding="utf-8").splitlines():
        parent, kind, *rest = line.split()
        if kind != "revolute":
            raise ValueError(f"a joint of kind {kind} is not written as URDF")
        x = np.array(rest, dtype=np.float64)
        inertia = x[[19, 20, 21, 20, 22, 23, 21, 23, 24]].reshape(3, 3)
        links.append(Link(int(parent), x[:3], x[3:12].reshape(3, 3), x[12:15], float(x[15]), x[16:19], inertia))
    return links


def urdf(links: list[Link]) -> str:
    """Return a URDF; link 0 is the base."""
    unit = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'  # of the base, which does not move
    base = f'<link name="link0"><inertial><origin xyz="0 0 0"/><mass value="1"/>{unit}</inertial></link>'
    text = f'<robot name="robot">{base}'
    for number, link in enumerate(links, 1):
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia.tolist()
        text += (
            f'<link name="link{number}"><inertial><origin xyz="{_words(link.center)}" rpy="0 0 0"/><mass'
            f' value="{link.mass!r}"/><inertia ixx="{xx!r}" ixy="{xy!r}" ixz="{xz!r}" iyy="{yy!r}" iyz="{yz!r}"'
            f' izz="{zz!r}"/></inertial></link><joint name="joint{number}" type="revolute"><origin'
            f' xyz="{_words(link.position)}" rpy="{_words(_angles(link.rotation))}"/><parent link="link{link.parent}"/>'
            f'<child link="link{number}"/><axis xyz="{_words(link.axis)}"/><limit lower="-10" upper="10" effort="1e9"'
            ' velocity="1e9"/></joint>'
        )
    return text + "</robot>"


def _words(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _angles(rotation: Any) -> tuple[float, float, float]:
    """Return roll, pitch and yaw."""
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if math.hypot(rotation[0, 0], rotation[1, 0]) < 1e-12:
        return 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])
