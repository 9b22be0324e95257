"""MJCF: attributes that change MuJoCo's equations change eomgen's alike, alone, with flags and with each other."""

from __future__ import annotations

from itertools import combinations, islice
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.mjcf_pairs import CHANGES, ELEMENTS, FLAGS, changes, flagged, machine
from tests.oracles.mjcf_oracle import Imported
from tests.robots.mjcf_mutants import equations

#: Largest relative difference to MuJoCo's mass matrix and forces.
_EQUAL = 1e-9
#: Attributes whose effect is of constraints, which are exact here or left out with a note.
_OF_CONSTRAINTS = ("frictionloss", "range")


def differs(text: str, file: Path) -> bool:
    """Return whether a file that is read has other equations than MuJoCo's."""
    file.write_text(text, encoding="utf-8")
    try:
        imported = Imported.of(file)
    except eomgen.EomgenError:
        return False
    return not max(imported.errors(states=3)) < _EQUAL


def changes_equations(element: str, text: str) -> bool:
    """Return whether an attribute changes MuJoCo's equations at some state, with the attributes that it needs."""
    needed = text.partition("; ")[2]
    for seed in range(3, 9):
        before = equations(machine((element, needed)) if needed else machine(elements=(element,)), seed)
        after = equations(machine((element, text)), seed)
        assert after is not None, f"MuJoCo refuses {text} of {element}"
        if before is None or before.shape != after.shape:
            return True
        if not np.allclose(before, after, rtol=1e-9, atol=1e-12, equal_nan=True):
            return True
    return False


@pytest.mark.slow
def test_every_change_changes_mujoco_s_equations() -> None:
    idle = [(element, text) for element, text in changes() if not changes_equations(element, text)]
    assert [pair for pair in idle if not pair[1].startswith(_OF_CONSTRAINTS)] == []
    assert len(list(flagged())) > 2000


#: Pairs in which a flag switched off too much or too little.
_NAMED = (
    ("hinge", "actuatorgravcomp=true; actuatorfrcrange=-0.2 0.3", "limit"),
    ("slide", "actuatorgravcomp=true; actuatorfrcrange=-0.2 0.3", "actuation"),
    ("slide", "actuatorgravcomp=true; actuatorfrcrange=-0.2 0.3", "spring and damper"),
    ("option", "wind=1 -2 0.5", "spring and damper"),
    ("body", "gravcomp=1.3", "spring and damper"),
    ("motor", "armature=0.4", "actuation"),
    ("motor", "damping=0.2 0.3", "actuation"),
)


@pytest.mark.parametrize(("element", "text", "flag"), [*_NAMED, *list(flagged())[::180]])
def test_pairs_of_attributes_and_flags_are_mujoco_s(element: str, text: str, flag: str, tmp_path: Path) -> None:
    assert not differs(machine((element, text), flags=FLAGS[flag]), tmp_path / "a.xml")


@pytest.mark.long
@pytest.mark.parametrize("element", CHANGES)
def test_a_tenth_of_the_pairs_of_attributes_and_flags_are_mujoco_s(element: str, tmp_path: Path) -> None:
    pairs = [(text, flag) for own, text, flag in flagged() if own == element][::10]
    wrong = [
        (text, flag) for text, flag in pairs if differs(machine((element, text), flags=FLAGS[flag]), tmp_path / "a.xml")
    ]
    assert wrong == []


@pytest.mark.long
def test_pairs_of_attributes_are_mujoco_s(tmp_path: Path) -> None:
    every = list(combinations(changes(), 2))
    in_turn = (every[k] for k in np.random.default_rng(5).permutation(len(every)))
    chosen = islice((pair for pair in in_turn if _fit(*pair)), 60)
    wrong = [pair for pair in chosen if differs(machine(*pair), tmp_path / "a.xml")]
    assert wrong == []


def _fit(first: tuple[str, str], second: tuple[str, str]) -> bool:
    """Return whether two changes set different attributes, and MuJoCo takes both."""
    if first[0] == second[0]:
        names = [{part.partition("=")[0] for part in text.split("; ")} for _, text in (first, second)]
        if names[0] & names[1]:
            return False
    return equations(machine(first, second)) is not None


@pytest.mark.parametrize("group", ["2", "0 2"])
def test_a_drive_of_a_disabled_group_keeps_its_rotor_and_damper(group: str, tmp_path: Path) -> None:
    text = machine(("option", f"actuatorgroupdisable={group}"), ("motor", "group=2; armature=0.3; damping=0.5"))
    assert not differs(text, tmp_path / "a.xml")


def test_support_through_a_drive_needs_a_drive(tmp_path: Path) -> None:
    # without an actuator MuJoCo has no forces of drives, and so no support of joints with actuatorgravcomp
    arm = """<mujoco><worldbody><body gravcomp="1"><joint axis="0 1 0" actuatorgravcomp="true"/>
      <geom size="0.1" pos="0.3 0 0"/><body gravcomp="0.5" pos="0.4 0 0"><joint type="slide" axis="0 0 1"/>
      <geom size="0.1"/></body></body></worldbody></mujoco>"""
    assert not differs(arm, tmp_path / "a.xml")


FAULTS = {
    '<muscle joint="j" lengthrange="0 1" timeconst="0 0.1"/>': "a time constant of 0 makes the rate of the activation",
    '<general joint="j" dyntype="filter" dynprm="0"/>': "a time constant of 0 makes the rate of the activation",
    '<dcmotor joint="j" motorconst="1" resistance="1" lugre="100 2 0 0.5 0.1"/>': "bristles without friction",
}


@pytest.mark.parametrize("actuator", FAULTS)
def test_constants_of_zero_that_divide_are_refused(actuator: str, tmp_path: Path) -> None:
    text = f"""<mujoco><worldbody><body><joint name="j"/><geom size="0.1" pos="1 0 0"/></body></worldbody>
      <actuator>{actuator}</actuator></mujoco>"""
    (tmp_path / "a.xml").write_text(text, encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match=FAULTS[actuator]):
        eomgen.load(tmp_path / "a.xml")


def test_all_read_attributes_of_drives_and_joints_are_changed() -> None:
    from eomgen.products.robots.leftovers import READ
    from eomgen.products.robots.mjcf.coverage import STATUSES

    changed: dict[str, set[str]] = {}
    for element, text in changes():
        names = changed.setdefault(ELEMENTS[element][0], set())
        names |= {part.partition("=")[0] for part in text.split("; ")}
    # by MuJoCo's compiler alone, or of a transmission, which one kind of actuator tries for all
    compiled = {"name", "class", "type", "childclass", "fitscale", "hfield", "mesh", "fullinertia", "inheritrange"}
    paths = set.union(*(changed["actuator/motor"], {"joint", "gear", "damping", "armature", "ctrllimited"}))
    missing = {
        key: sorted(rest)
        for key, names in changed.items()
        if (
            rest := {name for name, status in STATUSES[key].items() if status == READ}
            - names
            - compiled
            - (paths if key.startswith("actuator/") else set())
        )
    }
    assert missing == {
        "actuator/general": ["actdim", "actlimited", "actrange"],
        "actuator/intvelocity": ["actlimited", "actrange"],
        "tendon/fixed": ["actuatorfrclimited", "actuatorfrcrange"],
        "tendon/spatial": ["actuatorfrclimited", "actuatorfrcrange"],
    }
