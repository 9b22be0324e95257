"""Loads by formulas of the place where they act: its position, velocity, rotation and angular velocity."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.mechanics.test_cosserat_beams import states_near
from tests.models.cosserat import beam_scene
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.states import derivative, jacobian, on_base

pytestmark = pytest.mark.slow

TERMS = ("residual", "partials", "poses", "energy", "force")
#: A load that takes every quantity of its place, beside time, a parameter and the place along the beam.
LOAD = {
    "force": [
        "-0.3 * velocity.here[0] * sqrt(1 + velocity.here[1] ** 2) + 0.1 * t",
        "-load * position.here[1] * (1 + s)",
        "0.2 * angular_velocity.here[0] * position.here[2]",
    ],
    "moment": [
        "-0.4 * rotation.here[0]",
        "-load * angular_velocity.here[1]",
        "s * rotation.here[2] * velocity.here[0]",
    ],
}


def loaded(axes: str, joint: str, **more: Any) -> dict[str, Any]:
    data = beam_scene(4, {}, {"curvature": [0.02, -0.1, 0.05]}, type=joint)
    del data["forces"]
    return data | {"distributed_loads": {"wind": {"beam": "rope", "axes": axes, **LOAD}}} | more


MOVING = {"base": {"position": ["0.3 * t", "sin(t)", 0], "rotation": [{"axis": [0, 1, 2], "angle": "0.7 * t"}]}}


def on_nodes(data: dict[str, Any]) -> dict[str, Any]:
    """Return a scene with its distributed load as forces at the nodes, each with its share: s and weight as numbers."""
    data = dict(data)
    load = data.pop("distributed_loads")["wind"]
    data["forces"] = {}
    for node, (s, weight) in enumerate(zip((0.0, 0.25, 0.5, 0.75, 1.0), (1.25, 2.5, 2.5, 2.5, 1.25), strict=True)):
        entry = {
            key: [
                f"{weight} * ({text.replace('(1 + s)', f'(1 + {s})').replace('s * ', f'{s} * ')})"
                for text in load[name]
            ]
            for key, name in (("force", "force"), ("torque", "moment"))
        }
        axes = "body" if load["axes"] == "beam" else "world"
        data["forces"][f"at_{node}"] = {"body": "rope", "point": [10.0 * s, 0, 0], "axes": axes, **entry}
    return data


def states_of(system: System, rng: np.random.Generator) -> dict[str, Array]:
    state = states_near(system, rng) | {"t": np.full((6, 1), 0.7)}
    return on_base(tape_evaluator(system), state) if "base" in system.functions else state


def system_of(data: dict[str, Any], *more: str) -> System:
    return derive(from_data(data), (*TERMS, *more))


@pytest.mark.parametrize(
    ("axes", "joint", "base"), [("world", "fixed", MOVING), ("beam", "free", MOVING), ("beam", "fixed", {})]
)
def test_distributed_loads_are_those_of_forces_on_nodes(
    axes: str, joint: str, base: dict[str, Any], rng: np.random.Generator
) -> None:
    scene = loaded(axes, joint, **base)
    first, second = system_of(scene), system_of(on_nodes(scene))
    state = states_of(first, rng)
    found, expected = (tape_evaluator(system)("force", state)["Q"] for system in (first, second))
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)
    found, expected = (tape_evaluator(system)("energy", state)["energy"] for system in (first, second))
    np.testing.assert_allclose(found, expected, rtol=1e-11)


@pytest.mark.parametrize("axes", ["world", "beam"])
def test_definitions_of_the_place_are_their_text_at_each_node(axes: str, rng: np.random.Generator) -> None:
    scene = loaded(axes, "free")
    names = {"speed": "sqrt(1 + velocity.here[1] ** 2)", "lift": "-load * position.here[1] * (1 + s)"}
    load = scene["distributed_loads"]["wind"]
    force = [load["force"][0].replace(names["speed"], "speed"), "lift", load["force"][2]]
    parts = scene | {"definitions": names, "distributed_loads": {"wind": {**load, "force": force}}}
    whole, defined = system_of(scene), system_of(parts)
    assert {name: count.flops for name, count in defined.counts.items()} == {
        name: count.flops for name, count in whole.counts.items()
    }
    state = states_near(whole, rng) | {"t": np.full((6, 1), 0.7)}
    for name in TERMS:
        found, expected = (tape_evaluator(system)(name, state) for system in (defined, whole))
        for output, values in expected.items():
            np.testing.assert_array_equal(found[output], values)


def test_here_is_the_point_of_the_force(rng: np.random.Generator) -> None:
    formulas = ["-3 * velocity.{0}[0] + t", "position.{0}[2] * velocity.{0}[1]", "sin(position.{0}[0])"]
    systems = []
    for name in ("here", "tip"):
        force = {"body": "rope", "point": [10.0, 0.2, 0.1], "force": [text.format(name) for text in formulas]}
        data = loaded("world", "free", **MOVING) | {"points": {"tip": {"body": "rope", "position": [10.0, 0.2, 0.1]}}}
        systems.append(system_of(data | {"forces": {"drag": force}}))
    state = states_of(systems[0], rng)
    found, expected = (tape_evaluator(system)("residual", state)["r"] for system in systems)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("axes", ["world", "beam"])
def test_tangents_and_power(axes: str, rng: np.random.Generator) -> None:
    system = system_of(loaded(axes, "free"))
    evaluate, state = tape_evaluator(system), states_near(system, rng) | {"t": np.full((6, 1), 0.7)}
    found = evaluate("partials", state)
    for name, block in (("K", "q"), ("C", "v")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(found[name], expected, axes=2) < 1e-11
    stored = derivative(evaluate, system.factors, "energy", state, {"q": state["v"]})["energy"][:, 1]
    work = np.sum(evaluate("force", state)["Q"] * state["v"], axis=-1)
    np.testing.assert_allclose(work, evaluate("energy", state)["energy"][:, 2] - stored, rtol=1e-10)
