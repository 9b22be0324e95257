"""Partials in the tunable parameters against complex steps of the parameters through laws, equations and outputs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.models.cosserat import beam_scene
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.random_scenes import point_outputs, random_scene, with_loads
from tests.oracles.states import STEP, random_states

STATES = 3
OF_EQUATIONS = {
    "Rp": ("residual", "r"),
    "Fp": ("internal_rate", "zdot"),
    "Phip": ("constraint", "Phi"),
    "Zp": ("constraint_velocity", "w"),
}


def state_of(system: System, evaluate: Evaluate, rng: np.random.Generator) -> dict[str, Array]:
    """Return random states, the scene's own inputs and base at their times."""
    state = random_states(system, STATES, rng)
    state["t"] = rng.uniform(0.0, 3.0, size=(STATES, 1))
    if system.nz:
        state["z"] = rng.normal(size=(STATES, system.nz))
    if system.multipliers:
        state["lam"] = rng.normal(size=(STATES, len(system.multipliers)))
    return prescribed(system, evaluate, state)


def prescribed(system: System, evaluate: Evaluate, state: dict[str, Array]) -> dict[str, Array]:
    """Return a state with inputs that the scene gives, and the base, by their laws at the state's parameters."""
    found = dict(state)
    if "inputs" in system.functions:
        laws = evaluate("inputs", state)["u"]
        found["u"] = np.where([item == 0.0 for item in laws[0]], state["u"], laws)
    if "base" in system.functions:
        found["base"] = evaluate("base", state)["base"]
    return found


def by_complex_step(system: System, evaluate: Evaluate, function: str, output: str, state: dict[str, Array]) -> Array:
    """Return d output / dp, (STATES, values, np)."""
    columns = []
    for number in range(len(system.parameters)):
        p = state["p"].astype(complex)
        p[:, number] += 1j * STEP
        columns.append(evaluate(function, prescribed(system, evaluate, {**state, "p": p}))[output].imag / STEP)
    return np.stack(columns, axis=-1)


def check(scene: Scene, rng: np.random.Generator, tolerance: float = 1e-12) -> dict[str, Array]:
    """Hold all blocks of a scene to complex steps, and return what was found."""
    terms = [name for name, _ in OF_EQUATIONS.values()] + ["constraint_jacobian", "constraint_bias"]
    system = derive(scene, [*terms, "outputs", "parameter_partials", "output_parameter_partials"])
    evaluate = tape_evaluator(system)
    state = state_of(system, evaluate, rng)
    found = evaluate("parameter_partials", state)
    names = ["Rp", *(["Fp"] if system.nz else []), *(["Phip", "Zp", "Ap"] if system.multipliers else [])]
    assert list(found) == names
    for name in set(names) - {"Ap"}:
        expected = by_complex_step(system, evaluate, *OF_EQUATIONS[name], state)
        assert found[name].shape == expected.shape
        assert relative_error(found[name], expected, 2) <= tolerance, name
    if system.multipliers:
        of_B = by_complex_step(system, evaluate, "constraint_jacobian", "B", state)
        of_g = by_complex_step(system, evaluate, "constraint_bias", "g", state)
        expected = np.einsum("srcp,sc->srp", of_B, state["a"]) + of_g
        assert relative_error(found["Ap"], expected, 2) <= tolerance
    if scene.outputs:
        found |= evaluate("output_parameter_partials", state)
        expected = by_complex_step(system, evaluate, "outputs", "y", state)
        assert relative_error(found["Yp"], expected, 2) <= tolerance
    return found


def machine(coordinates: str = "joint", *, looped: bool = False) -> Scene:
    """Return an arm on a shaking base with a controller, a road under its foot and a strut, each with parameters."""
    builder = eomgen.SceneBuilder("machine", coordinates=coordinates)
    for name, value in {
        "mass": 1.5, "length": 0.6, "reach": 0.4, "stiffness": 20.0, "damping": 0.3, "lag": 0.05, "height": 0.1,
        "speed": 2.0, "dry": 0.2, "rotor": 0.02, "strut": 1.1,
    }.items():  # fmt: skip  # a table
        builder.parameter(name, value, tunable=True)
    builder.parameter("fixed", 2.0)
    builder.input("road", "height * sin(speed * t)").input("command")
    builder.base(position=["height * sin(3 * t)", 0, "0.2 * t"], rotation=[([0, 1, 0], "0.3 * speed * t")])
    builder.body("upper", "mass", center_of_mass=[0, 0, "length / 2"], inertia=[0.05, "0.04 + rotor", "0.02 * mass"])
    rotor = {"rotor_inertia": "rotor"} if coordinates == "joint" else {}
    dry = {"coulomb": "dry", "velocity": 0.1}
    given: dict[str, Any] = {"damping": "damping", "stiffness": "stiffness", "friction": dry, **rotor}
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, 1, 0], **given)
    builder.body("lower", "fixed * mass", center_of_mass=[0.1, 0, "reach"], inertia=[0.02, 0.02, 0.01])
    builder.joint("elbow", "revolute", "upper", "lower", axis=[1, 0, 0], position=[0, 0.1, "length"])
    builder.point("tip", "lower", [0, 0, "2 * reach"]).point("anchor", "base", [0.4, 0.2, 1.0])
    builder.spring("cord", "tip", "anchor", stiffness="stiffness", damping="damping", length="length")
    builder.state("effort", "(stiffness * (command - q.elbow) - effort + road) / lag")
    builder.effort("motor", "elbow", "effort - damping * v.elbow + 5 * road")
    if looped:
        builder.constraint("strut", "distance", "anchor", "tip", length="strut + 0.1 * sin(speed * t)")
    builder.output("felt", formula=["acceleration.tip[0]", "mass * position.tip[2] + road"])
    return builder.build()


@pytest.mark.slow_except("1")
@pytest.mark.parametrize("seed", range(4))
def test_random_trees(seed: int, rng: np.random.Generator) -> None:
    scene = with_loads(random_scene(seed, 2 + seed % 4, tunable=0.5), seed)
    assert check(point_outputs(scene), rng)["Rp"].shape[-1] > 0


def test_a_geometrically_exact_beam(rng: np.random.Generator) -> None:
    """Elements are a loop, so parameters of sections and loads go through its derivatives."""
    data = beam_scene(4, {"force": ["load", "2 * load", 0.0]}, {"stiffness_damping": "0.1 * lag"})
    data["parameters"]["lag"] = {"value": 0.02, "tunable": True}
    assert np.all(np.abs(check(eomgen.load(data), rng)["Rp"]).max(axis=(0, 1)) > 1e-3)


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(machine(looped=True))


@pytest.mark.slow
def test_what_cannot_be_differentiated_in(model: eomgen.Model) -> None:
    q, v, a = np.zeros((3, 2))
    with pytest.raises(UsageError) as caught:
        model.parameter_partials(q, v, a, of=["fixed"])
    assert "the parameter fixed exists, but its value is fixed in the code; try: fixed = {" in str(caught.value)
    with pytest.raises(UsageError, match="there is no parameter 'stifness'; try: stiffness"):
        model.parameter_partials(q, v, a, of=["stifness"])
    with pytest.raises(UsageError, match="of: parameters are a list of names, not the text 'mass'"):
        model.parameter_partials(q, v, a, of="mass")
    builder = eomgen.SceneBuilder("plain").body("rod", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("pin", "revolute", "base", "rod", axis=[0, 1, 0])
    plain = eomgen.build(builder.build(), ["inverse_dynamics"])
    with pytest.raises(UsageError, match="the scene has no tunable parameters, so there is nothing to differentiate"):
        plain.parameter_partials(plain.initial_q, plain.initial_v, plain.initial_v)


@pytest.mark.slow
def test_compiled_partials_of_outputs(model: eomgen.Model) -> None:
    found = model.output_parameter_partials([0.3, -0.2], [1.0, 0.5], [0.1, 0.2], 0.7, of=["height", "mass"])
    assert list(found) == ["felt"] and found["felt"].shape == (2, 2)
    position = model.point("lower", [0.0, 0.0, 0.8], [0.3, -0.2], t=0.7).position
    assert found["felt"][1, 1] == pytest.approx(position[2], rel=1e-12)
    assert found["felt"][1, 0] == pytest.approx(np.sin(2.0 * 0.7), rel=1e-12)
