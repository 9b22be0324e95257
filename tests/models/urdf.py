"""Scenes from texts of URDF, and files of robots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import pinocchio as pin

from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.scene.sources.register import checked_options, source_of

ROBOTS = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"
FILES = {
    "panda": "panda_description/urdf/panda.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "talos": "talos_data/robots/talos_full_v2.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
    "centauro": "centauro_description/urdf/centauro.urdf",
}


ARM = """\
<?xml version="1.0"?>
<robot name="arm">
  <link name="foot"/>
  <link name="upper">
    <inertial><mass value="2"/><origin xyz="0 0 0.5"/>
      <inertia ixx="1" iyy="1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="lower">
    <inertial><mass value="1"/><origin xyz="0 0 1" rpy="1.57079632679 0 0"/>
      <inertia ixx="1" iyy="2" izz="2.5" ixy="0" ixz="0" iyz="0.25"/></inertial>
  </link>
  <joint name="shoulder" type="continuous">
    <parent link="foot"/><child link="upper"/><axis xyz="0 2 0"/><dynamics damping="0.5"/>
  </joint>
  <joint name="elbow" type="fixed">
    <parent link="upper"/><child link="lower"/><origin xyz="0 0 1" rpy="0 0 1.57079632679"/>
  </joint>
</robot>
"""


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
    source = source_of(Path("robot.urdf"))
    assert source is not None
    read = source.read(text, file=file, strict=strict, **checked_options(source, options))
    data = {**read.data, "task_frames": list(task_frames)} if task_frames else read.data
    return from_data(
        data,
        file=file,
        lines=read.lines,
        notes=read.notes,
        inertias_checked=read.inertias_checked,
        coordinates=coordinates,
    )


def replaced(old: str, new: str) -> str:
    """Return the text of the arm with a part replaced."""
    assert old in ARM
    return ARM.replace(old, new)
