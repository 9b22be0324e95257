"""Differences between descriptions of one machine, planted one by one: each is named first."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

import eomgen

FOLDER = Path(__file__).parent
URDF = (FOLDER / "arm.urdf").read_text(encoding="utf-8")
#: The same arm, as ``mj_saveLastXML`` of MuJoCo 4.0 writes it, with 12 digits in place of 6.
MJCF = (FOLDER / "arm.xml").read_text(encoding="utf-8")
SCENE = (FOLDER / "four_bar.toml").read_text(encoding="utf-8")
#: Further joints, forces and inputs.
BENCH = (FOLDER / "bench.toml").read_text(encoding="utf-8")


class Planted(NamedTuple):
    """One change of a description: text and new text, and the expected answer."""

    old: str
    new: str
    element: str
    quantity: str


OF_SCENE = (
    Planted("arm = 0.4", "arm = 0.41", "constraints.closure", "first position"),
    Planted('type = "revolute"\nfirst', 'type = "cylindrical"\nfirst', "constraints.closure", "type"),
    Planted("stiffness = 200", "stiffness = 0.2", "springs.return", "stiffness"),
    Planted("damping = 5", "damping = 0", "springs.return", "damping"),
    Planted("2 * sin(3 * t)", "2 * sin(3 * t * pi / 180)", "efforts.motor", "effort"),
    Planted("length = 0.3", "length = 0.15", "springs.return", "length"),
    Planted("position = [0.1, 0, 0.5]", "position = [0.1, 0, 500]", "points.hook", "position.2"),
)  # fmt: skip  # a table

OF_BENCH = (
    Planted("multiplier = -2.0", "multiplier = 2.0", "joints.j6", "multiplier"),
    Planted("offset = 0.1", "offset = 5.7295779513", "joints.j6", "offset"),
    Planted('mimic = { joint = "j5", multiplier = -2.0, offset = 0.1 }', "", "joints.j6", "mimic"),
    Planted("second_axis = [0, 1, 0]", "second_axis = [1, 0, 0]", "joints.j1", "second_axis"),
    Planted("pitch = 0.01", "pitch = 0.06283185307", "joints.j2", "pitch"),
    Planted("rest = 0.3", "rest = 17.188733853924695", "joints.j2", "rest"),
    Planted("k = 30", "k = 0.5235987756", "joints.j2", "stiffness"),
    Planted("position = [0.1, 0, 0]", "position = [0, 0.1, 0]", "joints.j4", "position"),
    Planted("mass = 0.3", "mass = 0.0", "bodies.tool", "mass"),
    Planted('rate = "(u - z) / 0.05"', 'rate = "(u - z) / 0.5"', "states.z", "rate"),
    Planted('"z * 3 + 0.1 * u"', '"z * 3 + 0.1"', "efforts.motor", "effort"),
    Planted('joint = "j5"\neffort', 'joint = "j2"\neffort', "efforts.motor", "joint"),
    Planted("0.01 * sin(5 * t)", "0.01 * cos(5 * t)", "base", "position.0"),
    Planted("gravity = [0, 0, -9.81]", "gravity = [0, 0, 0]", "gravity", "gravity"),
    Planted('type = "spherical"', 'type = "free"', "joints.j3", "type"),
)  # fmt: skip  # a table

#: Descriptions with their differences.
DESCRIPTIONS = {
    "scene": (".toml", SCENE, OF_SCENE),
    "bench": (".toml", BENCH, OF_BENCH),
}


def _compared(folder: Path, ending: str, text: str, old: str, new: str) -> eomgen.Comparison:
    assert text.count(old) == 1, old
    first, second = folder / f"first{ending}", folder / f"second{ending}"
    first.write_text(text)
    second.write_text(text.replace(old, new))
    return eomgen.compare(first, second, states=2)


def _check(folder: Path, ending: str, text: str, planted: Planted) -> None:
    comparison = _compared(folder, ending, text, planted.old, planted.new)
    assert not comparison.equal
    first = comparison.first
    assert first is not None
    assert (first.element, first.quantity) == (planted.element, planted.quantity), str(comparison)
    assert first.places[1].startswith(f"second{ending}"), first.places


@pytest.mark.slow
@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_all_planted_differences_are_named_first(name: str, tmp_path: Path) -> None:
    """With element, quantity and place in the second file."""
    ending, text, every = DESCRIPTIONS[name]
    for planted in every:
        _check(tmp_path, ending, text, planted)


def test_names_and_starts_are_noted(tmp_path: Path) -> None:
    """No equation follows from either."""
    comparison = _compared(tmp_path, ".toml", SCENE, "initial.position = -1.2", "initial.position = 1.2")
    assert comparison.equal
    assert "the joint pin starts at -1.2 and 1.2" in comparison.notes
    comparison = _compared(tmp_path, ".urdf", URDF, 'name="elbow"', 'name="elbo"')
    assert comparison.equal
    assert "the joint elbow is elbo in the second" in comparison.notes
