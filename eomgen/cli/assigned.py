"""Parameters, inputs, states and joints of a scene named by ``--set``, ``--input`` and ``--initial``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene

_PARTS = {"q": "position", "v": "velocity"}


def check_assigned(scene: Scene, changes: Mapping[str, object], signals: Mapping[str, object], *, robot: bool) -> None:
    """Raise UsageError for a parameter or an input that another option gives.

    Parameters
    ----------
    changes, signals : of ``--set`` and of ``--input``, by name
    robot : whether the scene was read from a URDF, whose options make inputs and tunable parameters
    """
    inputs, tunable = [item.name for item in scene.inputs], [item.name for item in scene.parameters if item.tunable]
    joints, links = [item.name for item in scene.joints], [item.name for item in scene.bodies]
    for name, value in changes.items():
        if name in inputs and name not in tunable:
            raise UsageError(Problem(f"--set {name}", f"{name} is an input", f"--input {name}={_said(value)}"))
        body = max((link for link in links if name == link or name.startswith(f"{link}_")), key=len, default="")
        if robot and body and name not in tunable:
            fault = f"the mass, the centre of mass and the inertia of {body} are fixed in the code"
            raise UsageError(Problem(f"--set {name}", fault, f"--tunable {body}, which makes them parameters"))
    for name, value in signals.items():
        if name in tunable and name not in inputs:
            raise UsageError(Problem(f"--input {name}", f"{name} is a parameter", f"--set {name}={_said(value)}"))
        if robot and name in joints and name not in inputs:
            fault = f"{name} is a joint, which no input drives"
            raise UsageError(Problem(f"--input {name}", fault, "--actuated, for an effort of every joint"))


def _said(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def starts_of(starts: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Return ``initial`` of a run: ``q.JOINT`` and ``v.JOINT`` are position and velocity of a joint."""
    joints = {joint.name for joint in scene.joints}
    parts = {name: name.partition(".") for name in starts}
    of_joints = {name: joint for name, (letter, _, joint) in parts.items() if letter in _PARTS and joint in joints}
    result = {name: value for name, value in starts.items() if name not in of_joints}
    for name, joint in of_joints.items():
        whole = result.get(joint, {})
        known = whole if isinstance(whole, dict) else {"position": whole}
        result[joint] = {**known, _PARTS[parts[name][0]]: starts[name]}
    return result
