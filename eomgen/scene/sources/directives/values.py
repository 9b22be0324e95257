"""Values of YAML files with their lines: mappings, lists, numbers and poses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import nearest, shown
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import about_axis, roll_pitch_yaw, snapped_rotation, unit_axis
from eomgen.scene.sources.urdf.reading import NUMBER

_BOOLEANS = {"true": True, "false": False}
#: Keys of a pose, and of rotations by tag, each with the number of its values.
POSE = ("base_frame", "translation", "rotation")
_ROTATIONS = {"!Rpy": {"deg": 3}, "!AngleAxis": {"angle_deg": 1, "axis": 3}, "!Identity": {}}
#: Tags of values that are drawn at random.
_DRAWN = ("!Uniform", "!UniformVector", "!UniformDiscrete", "!Gaussian", "!GaussianVector")


@dataclass(frozen=True)
class Pose:
    """Orientation and position of a frame in another one."""

    orientation: Array
    position: Array

    def then(self, inner: Pose) -> Pose:
        """Return the pose of a frame that is given in this one."""
        return Pose(self.orientation @ inner.orientation, self.orientation @ inner.position + self.position)

    @property
    def inverse(self) -> Pose:
        """Pose of the outer frame in the inner one."""
        return Pose(self.orientation.T, -self.orientation.T @ self.position)


def identity() -> Pose:
    """Return the pose of a frame in itself."""
    return Pose(np.eye(3), np.zeros(3))


class Values:
    """Reads values of one file; faults go to the report, and keys that are not read to ``unread``."""

    def __init__(self, text: str, file: str, report: Report) -> None:
        self.file, self.report = file, report
        self.unread: list[tuple[int, str]] = []
        self.root = self._parsed(text)

    def _parsed(self, text: str) -> Any:
        yaml = yaml_module()
        try:
            return yaml.compose(text, Loader=yaml.SafeLoader)
        except yaml.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            place = f"{self.file}:{mark.line + 1}" if mark is not None else self.file
            fault = f"this is not YAML: {getattr(error, 'problem', None) or 'a character that is not allowed'}"
            raise DescriptionError(Problem(place, fault, "directives: and a list of - add_model: ...")) from None
        except RecursionError:
            raise DescriptionError(Problem(self.file, "values are nested too deep", "")) from None

    def line(self, node: Any) -> int:
        """Return the line of a value, from 1."""
        return int(node.start_mark.line) + 1 if node is not None else 1

    def refuse(self, node: Any, fault: str, hint: str) -> None:
        """Report a fault of a value."""
        self.report.add_place(self.file, self.line(node), "", fault, hint)

    def entries(self, node: Any, title: str) -> dict[str, Any]:
        """Return the values of a mapping by key."""
        if node is None or node.id != "mapping":
            self.refuse(node, f"{title}: keys with values are needed here", f"{title}: and lines with key: value")
            return {}
        result: dict[str, Any] = {}
        for key, value in node.value:
            name = str(key.value)
            if name in result:
                self.refuse(key, f"{title}: the key {shown(name)} is there twice", "one of them")
            result[name] = value
        return result

    def known(self, node: Any, title: str, keys: tuple[str, ...]) -> dict[str, Any]:
        """Return the values of a mapping; keys besides the known ones are noted as unread."""
        entries = self.entries(node, title)
        for name, value in entries.items():
            if name not in keys:
                hint = nearest(name, keys)
                meant = f" (is {hint} meant?)" if hint and not hint.startswith("one of ") else ""
                self.unread.append((self.line(value), f"not read: {name[:64]} of {title}{meant}"))
        return {name: value for name, value in entries.items() if name in keys}

    def items(self, node: Any, title: str) -> Iterator[Any]:
        """Yield the values of a list."""
        if node is None or node.id != "sequence":
            self.refuse(node, f"{title}: a list is needed here", f"{title}: and lines that begin with -")
            return
        yield from node.value

    def text(self, node: Any, title: str) -> str:
        """Return a text; empty for a fault."""
        if node is None or node.id != "scalar" or not node.value:
            self.refuse(node, f"{title}: a text is needed here", "")
            return ""
        return str(node.value)

    def flag(self, node: Any, title: str) -> bool:
        """Return a Boolean value."""
        text = self.text(node, title)
        if text and text.lower() not in _BOOLEANS:
            self.refuse(node, f"{title}: true or false is needed here, not {shown(text)}", "true or false")
        return _BOOLEANS.get(text.lower(), False)

    def numbers(self, node: Any, title: str, count: int | None) -> list[float]:
        """Return ``count`` finite numbers, any number of them with None; zeros for a fault."""
        fallback = [0.0] * (count or 0)
        if node.tag in _DRAWN:
            self.refuse(node, f"{title}: a value that is drawn ({node.tag}) is not read", "a number")
            return fallback
        nodes = node.value if node.id == "sequence" else [node]
        texts = [str(item.value) for item in nodes if item.id == "scalar"]
        good = len(texts) == len(nodes) and all(NUMBER.fullmatch(text) for text in texts)
        if not good or (count is not None and len(texts) != count) or not all(math.isfinite(float(t)) for t in texts):
            needed = "numbers are" if count is None else "a number is" if count == 1 else f"{count} numbers are"
            given = " ".join(texts) if texts else "something else"
            self.refuse(node, f"{title}: {needed} needed here, not {shown(given)}", "[0, 0, 1]" if count == 3 else "")
            return fallback
        return [float(text) for text in texts]

    def pose(self, node: Any, title: str) -> tuple[Pose, str]:
        """Return a pose, and the frame in which it is given; empty without one."""
        if node is None:
            return identity(), ""
        entries = self.known(node, title, POSE)
        frame = self.text(entries["base_frame"], "base_frame") if "base_frame" in entries else ""
        position = self.numbers(entries["translation"], "translation", 3) if "translation" in entries else [0.0] * 3
        turned = self.rotation(entries["rotation"]) if "rotation" in entries else np.eye(3)
        return Pose(turned, np.array(position)), frame

    def rotation(self, node: Any) -> Array:
        """Return a rotation by its tag."""
        if node.tag not in _ROTATIONS:
            fault = f"rotation: the kind {shown(node.tag)} is not read"
            self.refuse(
                node, fault, "!Rpy { deg: [0, 0, 90] }, !AngleAxis { angle_deg: 90, axis: [0, 0, 1] }, !Identity"
            )
            return np.eye(3)
        sizes = _ROTATIONS[node.tag]
        entries = self.known(node, node.tag, tuple(sizes)) if node.id == "mapping" else {}
        values = {}
        for key, count in sizes.items():
            if key not in entries:
                self.refuse(node, f"rotation: {node.tag} has no {key}", f"{key}: ...")
                return np.eye(3)
            values[key] = self.numbers(entries[key], key, count)
        if node.tag == "!AngleAxis":
            axis = unit_axis(tuple(values["axis"]))
            if axis is None:
                self.refuse(node, "rotation: the axis has no direction", "axis: [0, 0, 1]")
                return np.eye(3)
            return snapped_rotation(np.array(about_axis(axis, math.radians(values["angle_deg"][0]))))
        angles = [math.radians(angle) for angle in values.get("deg", [0.0] * 3)]
        return snapped_rotation(roll_pitch_yaw(*angles))


def yaml_module() -> Any:
    """Return the package ``yaml``. Raises UsageError if it is missing."""
    try:
        import yaml  # noqa: PLC0415  # an extra
    except ImportError:
        fault = "model directives are YAML, and the package pyyaml is not installed"
        raise UsageError(Problem("load", fault, "pip install 'eomgen[yaml]'")) from None
    return yaml
