"""States of a check of a model that is evaluated on the tape: along a motion, near it, and consistent in all blocks."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.coordinates import coordinate_names
from eomgen.errors import EomgenError, NumericalError
from eomgen.lie.product import difference
from eomgen.products.studies.verification import states as drawing
from eomgen.products.studies.verification.claims.claim import Space
from eomgen.products.studies.verification.states import AMPLITUDE, draw
from tests.studies.claims_of_scenes import space_of


@cache
def top() -> Space:
    """Return a top on a ball joint with a slider, whose force is the square root of its place, on a moving base."""
    builder = eomgen.SceneBuilder("top").parameter("heave", 0.1, tunable=True).input("command").input("law", "sin(t)")
    builder.base(position=["heave * sin(3 * t)", 0, "0.2 * t"])
    builder.body("rod", 0.4, center_of_mass=[0.1, 0, -0.3], inertia=[0.02, 0.02, 0.005])
    builder.joint("ball", "spherical", "base", "rod")
    builder.body("bob", 0.7, inertia=[0.01, 0.01, 0.02])
    builder.joint("rail", "prismatic", "rod", "bob", axis=[0, 0, 1]).state("lag", "q.rail - lag")
    builder.effort("push", "rail", "command + law + sqrt(q.rail + 1) * lag")
    scene = builder.simulation(step=0.01, duration=6.0).build()
    return space_of(scene, ("residual", "poses", "second_partials", "partials"))


class Functions:
    """Functions of a model, evaluated on the tape at one state."""

    def __init__(self, space: Space) -> None:
        self.engine = space.engine
        system = space.system
        self.sizes = {"v": system.nv, "lam": len(system.multipliers), **system.second_sizes}

    def __contains__(self, name: str) -> bool:
        return name in self.engine

    def __call__(self, name: str, blocks: Any) -> tuple[np.ndarray, ...]:
        return tuple(self.engine(name, {key: np.atleast_1d(array) for key, array in blocks.items()}).values())


class Model:
    """What states are drawn of; a run turns the ball and moves the slider, evenly in time."""

    def __init__(self, space: Space, **facts: Any) -> None:
        system, scene = space.system, space.scene
        self.functions, self.description, self.scene, self.name = Functions(space), space.description, scene, "top"
        self.factors, self.nv, self.nz, self.nu = system.factors, system.nv, system.nz, system.nu
        self.initial_q, self.initial_v = np.array(system.initial_q), np.zeros(system.nv)
        self.initial_z, self.multipliers = np.array([0.25]), ()
        self.v_names, self.z_names = coordinate_names(system.factors)[1], ["z.lag"]
        self.v_units = ("rad/s", "rad/s", "rad/s", "m/s")
        self.parameters = {"heave": 0.1}
        self.bodies, self.terms = ("rod", "bob"), ("poses",)
        self.success, self.asked = True, []
        vars(self).update(facts)

    def pose(self, body: str, q: np.ndarray) -> np.ndarray:
        return np.array([1.0, 0, 0, 0, 0, 0, 3.0 if body == "bob" else 0.0])

    def parameter_array(self) -> np.ndarray:
        return np.array([0.1])

    def input_values(self, t: float) -> np.ndarray:
        return np.array([0.0, np.sin(t)])

    def base(self, t: float) -> np.ndarray:
        return self.functions.engine("base", {"t": np.array([t]), "p": self.parameter_array()})["base"].ravel()

    def simulate(self, end: float, record_every: int, error_estimate: bool) -> Any:
        self.asked.append((end, record_every, error_estimate))
        if not self.success and self.success is not False:
            raise NumericalError("no start")
        t = np.linspace(0.0, end, 1 + round(end / (0.01 * record_every)))
        half = 0.1 * t[:, None]
        q = np.hstack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half, 0.5 * half])
        v = np.broadcast_to([0.2, 0.0, 0.0, 0.05], (len(t), 4)).copy()
        return SimpleNamespace(t=t, q=q, v=v, z=0.25 + 0.1 * half, success=self.success, message="it stops")


def drawn(count: int = 8, **facts: Any) -> tuple[Any, Space, Model]:
    space, model = top(), Model(top(), **facts)
    found = draw(model, space.system, space.engine, count, np.random.default_rng(5))  # type: ignore[arg-type]
    return *found, model


def test_half_of_the_states_are_of_a_motion_and_the_others_near_it() -> None:
    states, space, model = drawn()
    assert model.asked == [(0.6, 20, False)]
    times = ["initial state", "t = 0.2 s", "t = 0.4 s", "t = 0.6 s"]
    assert states.names == (*times, *(f"random state {k}" for k in range(4))) and states.notes == ()
    blocks, factors = states.blocks, model.factors
    motion = model.simulate(0.6, 20, False)
    np.testing.assert_allclose(blocks["q"][:4], motion.q)
    np.testing.assert_allclose(blocks["v"][:4], motion.v)
    np.testing.assert_allclose(blocks["t"][:4, 0], motion.t)
    # 1 rad, and a fifth of the size of the machine, 3 m
    apart = np.min([np.abs(difference(factors, np.tile(q, (4, 1)), blocks["q"][4:])) for q in motion.q], axis=0)
    assert np.all(apart <= [AMPLITUDE + 1e-12] * 3 + [0.6]) and np.all(apart.max(axis=0) > 0.05)
    slow = np.abs(blocks["v"][4:] - motion.v[0])
    assert np.all(slow <= [1.0, 1.0, 1.0, 3.0]) and slow[:, 3].max() > 1.0
    assert np.all(blocks["t"][4:] >= 0.0) and blocks["t"][4:].max() > 0.6 and np.all(blocks["t"] <= 6.0)
    assert np.all(np.abs(blocks["z"][4:] - 0.25) <= 0.3 * 0.26 + 0.01)
    np.testing.assert_allclose(blocks["p"], 0.1)
    for k, t in enumerate(blocks["t"][:, 0]):
        np.testing.assert_allclose(blocks["base"][k], model.base(t))
        assert np.all(np.abs(blocks["u"][k] - model.input_values(t)) <= 0.3)
    assert np.abs(blocks["u"][:, 0]).max() > 0.02
    assert np.all(np.abs(blocks["a"]) <= [2.0, 2.0, 2.0, 6.0]) and np.abs(blocks["a"][:, 3]).max() > 2.0
    for name, size in (("j", [2.0] * 3 + [6.0]), ("s", [2.0] * 3 + [6.0]), ("u_dot", [1.3] * 2), ("u_ddot", [1.3] * 2)):
        assert np.all(np.abs(blocks[name]) <= size) and np.all(np.abs(blocks[name]).max(axis=0) > 0.2)
    assert blocks["direction"].shape[0] == blocks["weights"].shape[0] == 8 and "lam" not in blocks
    assert np.all(np.abs(blocks["weights"]) <= 1.0) and np.abs(blocks["weights"]).max() > 0.5
    # q, v, a, z, lam, p and u: parameters by half of their value, inputs with a law not at all
    places = space.system.second_blocks.places("direction")
    of = {name: np.abs(blocks["direction"][:, columns]).max(axis=0) for name, columns in places.items()}
    assert np.all(of["q"] <= [1, 1, 1, 3]) and of["q"][3] > 1.0 and of["p"][0] <= 0.05 and 0.0 < of["u"][0] <= 1.0
    assert blocks["direction"][:, 0].min() < 0.0 < blocks["direction"][:, 0].max()
    assert of["u"][1] == 0.0 and np.all(of["z"] <= 0.27)


def test_spaces_have_the_scales_of_the_machine_and_the_motion() -> None:
    states, space, _ = drawn()
    for block in "qv":
        assert np.diag(space.along[block].matrix).tolist() == [1.0, 1.0, 1.0, 3.0]
    assert np.diag(space.along["z"].matrix) == pytest.approx([0.256])
    assert np.diag(space.along["p"].matrix) == pytest.approx([AMPLITUDE * 0.1])
    largest = np.abs(states.blocks["a"]).max(axis=0)
    assert np.diag(space.along["a"].matrix) == pytest.approx(np.maximum([1.0, 1.0, 1.0, 3.0], largest))
    assert space.rows["v"][3] == "v.rail" and space.rows["z"] == ("z.lag",) and space.rows["lam"] == ()
    assert space.few.names == space.rows["v"]


def test_one_state_is_the_initial_one_and_two_have_no_run_of_more() -> None:
    states, _, model = drawn(1)
    assert states.names == ("initial state",) and model.asked == []
    assert 0.0 < np.abs(states.blocks["u"]).max() <= 0.09  # nearer than those of random states
    two, _, model = drawn(2)
    assert two.names == ("initial state", "random state 0") and model.asked == []
    drawing._motion(model, 120, [])  # type: ignore[arg-type]
    assert model.asked == [(1.19, 1, False)]


def test_runs_that_fail_and_states_outside_of_domains_are_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    states, _, _ = drawn(4, success=None)
    assert states.notes == ("no motion to take states from: no start",)
    assert states.names[0] == "initial state" and len(states.names) == 4
    states, _, _ = drawn(8, success=False)
    assert states.notes == ("the motion to take states from ended early: it stops",)
    below = Model(top()).initial_q.copy()
    below[4] = -5.0
    states, _, _ = drawn(2, initial_q=below)
    assert states.names == () and states.blocks == {}
    assert states.notes == (
        "left out: initial state, where the equations of motion are not finite",
        "around the motion 1 of 1 states were not found: no finite or consistent ones",
    )


def test_states_of_constraints_are_consistent(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def consistent(q: np.ndarray, v: np.ndarray, t: float) -> Any:
        asked.append(t)
        if len(asked) == 1:
            raise EomgenError("far away")
        return SimpleNamespace(q=q, v=0.5 * v)

    monkeypatch.setattr(Functions, "__contains__", lambda self, name: name == "base")
    monkeypatch.setattr(drawing, "accelerations", lambda functions, values: (np.full(4, 7.0), np.full(2, 9.0)))
    facts: dict[str, Any] = {"multipliers": ("a", "b"), "consistent": consistent}
    states, _, model = drawn(4, **facts)
    np.testing.assert_array_equal(states.blocks["a"], 7.0)
    np.testing.assert_array_equal(states.blocks["lam"], 9.0)
    assert len(states.names) == 4 and len(asked) == 3
    # inputs of states of a constrained motion are those of their laws
    for k, t in enumerate(states.blocks["t"][:2, 0]):
        np.testing.assert_allclose(states.blocks["u"][k], model.input_values(t))

    def refused(functions: Any, values: Any) -> Any:
        raise NumericalError("rows depend on each other")

    monkeypatch.setattr(drawing, "accelerations", refused)
    assert drawn(2, **facts)[0].names == ()


def test_beams_bend_by_a_twentieth_of_their_length() -> None:
    model: Any = SimpleNamespace(
        nv=3, v_units=("m/s", "1/s", "rad/s"),
        description=SimpleNamespace(
            coordinates=[SimpleNamespace(name="rod", length=4.0), SimpleNamespace(name="x", length=0)]
        ),
        factors=[SimpleNamespace(name="rod", v_start=0, v_size=2, v=slice(0, 2)),
                 SimpleNamespace(name="x", v_start=2, v_size=1, v=slice(2, 3))],
    )  # fmt: skip  # a table
    scales = drawing._scales(model, [{"z": np.array([-2.0, 0.0])}, {"z": np.array([1.0, 0.0])}], 9.0)
    assert scales["v"].tolist() == [0.2, 0.05, 1.0] and scales["z"].tolist() == [2.0, 1.0]
