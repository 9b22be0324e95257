"""Joints of one kind between absolute bodies are one loop: the same equations, forces and partials as one by one, in a
text of one length, with a tape that grows in proportion to the bodies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.mechanics.constraints import loops
from eomgen.mechanics.derive import derive
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

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


def values(system: System, seed: int = 3) -> dict[str, np.ndarray]:
    """Return each output at a state away from the start, whole matrices in place of their nonzeros."""
    random = np.random.default_rng(seed)
    q = np.array(system.initial_q)
    for factor in system.factors:
        part = q[factor.q]
        part += 0.1 * random.standard_normal(len(part))
        if factor.group in ("SO3", "SE3"):
            part[:4] /= np.linalg.norm(part[:4])
    inputs = {name: random.standard_normal(system.nv) for name in ("v", "a")}
    inputs |= {"q": q, "t": np.array([0.3]), "p": np.array([item.value for item in system.parameters])}
    inputs |= {"lam": random.standard_normal(len(system.multipliers)), "base": random.standard_normal(25)}
    found: dict[str, np.ndarray] = {}
    for name, function in system.functions.items():
        if name not in TERMS:
            continue
        for block in function.outputs:
            numbers = np.array(evaluate(system.tape, block.refs, inputs), dtype=float)
            if name == "iteration":
                whole = np.zeros((system.nv, system.nv))
                whole[tuple(np.array(system.patterns[block.name], dtype=int).reshape(-1, 2).T)] = numbers
                numbers = whole
            found[f"{name}.{block.name}"] = numbers
    return found


@pytest.mark.long_except_every(2)
@pytest.mark.long_cases("kind2", "kind5")
@pytest.mark.slow_except("kind0")
@pytest.mark.parametrize(
    "kind",
    [
        {"joint": "revolute", "axis": [0, 1, 0]},
        {"joint": "spherical", "group": "R3xSO3"},
        {"joint": "universal", "axis": [0, 1, 0], "second_axis": [0, 0, 1], "shaken": True},
        {"joint": "helical", "axis": [0.3, 1, 0.2], "pitch": 0.01},
        {"joint": "prismatic", "axis": [1, 0.1, 0]},
        {"joint": "cylindrical", "axis": [0, 0, 1], "group": "R3xSO3"},
        {"joint": "planar", "axis": [0, 0, 1]},
    ],
)
def test_the_same_equations_as_one_by_one(kind: dict[str, object], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "FEWEST", 8)
    scene = chain(count=12, **kind)  # type: ignore[arg-type]  # keys of chain
    alike = derive(scene, TERMS)
    assert any(getattr(loop, "count", 0) == 11 and "joints" in getattr(loop, "label", "") for loop in alike.tape.maps)
    monkeypatch.setattr(loops, "FEWEST", 10**9)
    alone = derive(scene, TERMS)
    assert not alone.tape.maps
    assert alike.multipliers == alone.multipliers
    assert alike.row_units == alone.row_units
    found, expected = values(alike), values(alone)
    assert found.keys() == expected.keys()
    for name, numbers in expected.items():
        largest = np.max(np.abs(numbers))
        assert largest > 0.0, name
        np.testing.assert_allclose(found[name], numbers, rtol=1e-12, atol=1e-13 * largest, err_msg=name)


@pytest.mark.slow
def test_rows_left_out_have_no_force(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "FEWEST", 8)
    scene = chain("revolute", 12, axis=[0, 1, 0])
    left_out = (2, 9, 31)
    alike = derive(scene, TERMS, left_out)
    monkeypatch.setattr(loops, "FEWEST", 10**9)
    alone = derive(scene, TERMS, left_out)
    assert alike.multipliers == alone.multipliers
    found, expected = values(alike), values(alone)
    for name, numbers in expected.items():
        np.testing.assert_allclose(found[name], numbers, rtol=1e-12, atol=1e-13 * np.max(np.abs(numbers)), err_msg=name)


def grown(measure: Callable[[System], int]) -> list[int]:
    """Return a number of the systems of 24, 48 and 96 rods."""
    return [measure(derive(chain("revolute", count, axis=[0, 1, 0]), TERMS)) for count in (24, 48, 96)]


@pytest.mark.long
def test_the_tape_grows_by_as_many_operations_for_each_body() -> None:
    few, more, most = grown(lambda system: len(system.tape.op))
    assert most - more == pytest.approx(2 * (more - few), rel=1e-3)  # constants of bodies may coincide
    assert (more - few) / 24 <= 711


@pytest.mark.long
def test_functions_have_statements_that_do_not_grow() -> None:
    terms = ["residual", "constraint_velocity", "constraint_bias", "iteration"]

    def statements(system: System) -> int:
        program = to_program(system, functions=terms)
        loops_ = sum(len(loop.statements) for loop in program.loops)
        return loops_ + sum(len(part.statements) for function in program.functions for part in function.parts)

    few, more, most = grown(statements)
    assert most <= 1.02 * more
    assert more <= 1.1 * few


@pytest.mark.long
def test_a_run_stays_on_the_joints() -> None:
    model = eomgen.build(chain("revolute", 20, axis=[0, 1, 0]), profile="instant")
    run = model.simulate(0.05, 1e-3, method="generalized_alpha", error_estimate=False)
    assert run.success, run.message
    in_joints = eomgen.build(chain("revolute", 20, axis=[0, 1, 0], coordinates="joint"), profile="instant")
    other = in_joints.simulate(0.05, 1e-3, method="generalized_alpha", error_estimate=False)
    assert np.max(np.abs(model.evaluate("constraint", run.q[-1], t=0.05)["Phi"])) < 1e-11
    tip, expected = (
        of.evaluate("poses", at.q[-1], t=0.05)["pose"][-1, 4:] for of, at in ((model, run), (in_joints, other))
    )
    np.testing.assert_allclose(tip, expected, atol=1e-6)
