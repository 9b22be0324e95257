"""Joints of one kind between absolute bodies are one loop: the same equations, forces and partials as one by one, in a
text of one length, with a tape that grows in proportion to the bodies."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.mechanics.constraints import loops
from eomgen.mechanics.derive import derive
from eomgen.system.system import System
from tests.mechanics.checks import check_same_values

TERMS = (
    "residual", "iteration", "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian",
    "constraint_size", "velocity_partials", "energy",
)  # fmt: skip  # a table
LENGTH = 0.5


def chain(
    joint: str, count: int, *, group: str = "SE3", shaken: bool = False, coordinates: str = "absolute", **keys: object
) -> eomgen.Scene:
    """Return a chain of rods that hangs on the base and starts along x."""
    data: dict[str, object] = {"format": 1, "name": "chain", "coordinates": coordinates}
    data["parameters"] = {"reach": {"value": LENGTH, "unit": "m", "tunable": True}}
    bodies, joints = {}, {}
    for k in range(count):
        mass = 1.0 + 0.01 * k
        bodies[f"rod{k}"] = {
            "mass": mass, "center_of_mass": [LENGTH / 2, 0.01, 0.02], "inertia": [0.01, 0.02, 0.03],
            **({"group": group} if coordinates == "absolute" else {}),
        }  # fmt: skip  # a body
        place = ["reach" if k else 0.0, 0.003 * k + 0.001, 0]
        joints[f"joint{k}"] = {
            "type": joint, "parent": f"rod{k - 1}" if k else "base", "child": f"rod{k}", "position": place, **keys,
        }  # fmt: skip  # a joint
    data |= {"bodies": bodies, "joints": joints}
    if shaken:
        data["base"] = {"position": ["0.1*sin(3*t)", 0, 0], "rotation": [{"axis": [0, 1, 0], "angle": "0.2*sin(2*t)"}]}
    return eomgen.load(data)


HINGES: dict[str, object] = {"joint": "revolute", "axis": [0, 1, 0]}
KINDS: dict[str, dict[str, object]] = {
    "hinges": HINGES,
    "rows left out": HINGES,
    "balls": {"joint": "spherical", "group": "R3xSO3"},
    "crosses": {"joint": "universal", "axis": [0, 1, 0], "second_axis": [0, 0, 1], "shaken": True},
    "screws": {"joint": "helical", "axis": [0.3, 1, 0.2], "pitch": 0.01},
    "sliders": {"joint": "prismatic", "axis": [1, 0.1, 0]},
    "cylinders": {"joint": "cylindrical", "axis": [0, 0, 1], "group": "R3xSO3"},
    "planes": {"joint": "planar", "axis": [0, 0, 1]},
}


@pytest.mark.slow_except("hinges")
@pytest.mark.parametrize("name", KINDS)
def test_the_same_equations_as_one_by_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "FEWEST", 8)
    scene = chain(count=12, **KINDS[name])  # type: ignore[arg-type]  # keys of chain
    left_out = (2, 9, 31) if name == "rows left out" else ()
    alike = derive(scene, TERMS, left_out)
    counts = [loop.count for loop in alike.tape.maps if "joints" in getattr(loop, "label", "")]
    assert left_out or 11 in counts
    monkeypatch.setattr(loops, "FEWEST", 10**9)
    alone = derive(scene, TERMS, left_out)
    assert not alone.tape.maps
    assert alike.multipliers == alone.multipliers and alike.row_units == alone.row_units
    expected = check_same_values(alike, alone, TERMS)
    assert left_out or all(np.max(np.abs(numbers)) > 0.0 for numbers in expected.values())


@pytest.mark.slow
def test_tape_and_text_of_long_chains_grow_as_they_may() -> None:
    """The tape by as many operations for each body, the statements of functions not at all."""
    systems = [derive(chain("revolute", count, axis=[0, 1, 0]), TERMS) for count in (24, 48, 96)]
    few, more, most = (len(system.tape.op) for system in systems)
    assert most - more == pytest.approx(2 * (more - few), rel=1e-3)  # constants of bodies may coincide
    assert (more - few) / 24 <= 711

    def statements(system: System) -> int:
        names = ["residual", "constraint_velocity", "constraint_bias", "iteration"]
        program = to_program(system, functions=names)
        parts = [part for function in program.functions for part in function.parts]
        return sum(len(loop.statements) for loop in program.loops) + sum(len(part.statements) for part in parts)

    few, more, most = (statements(system) for system in systems)
    assert most <= 1.02 * more
    assert more <= 1.1 * few
