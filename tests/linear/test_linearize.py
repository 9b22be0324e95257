"""Where linear models are made: about equilibria, initial states, runs; compiled once; and what is said of bad
requests."""

from __future__ import annotations

import math
import pickle
import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen import ModelError, NumericalError, UsageError
from eomgen.products.linear.analyses.linearize import _check_finite
from eomgen.products.linear.state_space import _solve
from tests.linear.test_closed_forms import motor, slider_crank
from tests.linear.test_neighbouring_motions import disc


@pytest.fixture(scope="module")
def driven() -> eomgen.Model:
    return eomgen.build(motor(), profile="instant")


@pytest.fixture(scope="module")
def crank() -> eomgen.Model:
    return eomgen.build(slider_crank("joint"), profile="instant")


@pytest.fixture(scope="module")
def rolling() -> eomgen.Model:
    return eomgen.build(disc(), profile="instant")


def test_along_a_run(driven: eomgen.Model) -> None:
    solution = driven.simulate(0.5, 1e-3, inputs={"torque": lambda t: 2.0 * t}, initial={"hinge": 0.4})
    lin = solution.linearize(0.3)
    state = solution.at(0.3)
    same = driven.linearize(state.q, state.v, t=0.3, u={"torque": 0.6})
    np.testing.assert_array_equal(lin.K0, same.K0)
    np.testing.assert_array_equal(lin.reference.u, [0.6, 0.1 * math.sin(0.3)])
    assert lin.reference.what == "motion"
    np.testing.assert_allclose(lin.reference.a, state.a, atol=1e-3)
    with pytest.raises(UsageError, match="a linear model needs the model and the inputs of the run"):
        pickle.loads(pickle.dumps(solution)).linearize(0.3)
    again = driven.attach(pickle.loads(pickle.dumps(solution)), {"torque": lambda t: 2.0 * t})
    np.testing.assert_array_equal(again.linearize(0.3).K0, lin.K0)


@pytest.mark.slow
def test_default_is_the_initial_state_where_nothing_balances() -> None:
    builder = eomgen.SceneBuilder("falling").body("stone", 2.0, inertia=[0.1, 0.2, 0.25])
    model = eomgen.build(builder.joint("flight", "free", "base", "stone").build(), profile="instant")
    lin = model.linearize()
    assert lin.reference.what == "initial state"
    np.testing.assert_allclose(lin.reference.a, [0, 0, 0, 0, 0, -9.81], atol=1e-14)
    with pytest.raises(NumericalError, match=r"nothing holds v\.flight\[5\]: it accelerates with -9\.81"):
        model.linearize(at="equilibrium")
    assert model.linearize(at="initial").reference.what == "initial state"


@pytest.mark.slow
def test_an_equilibrium_beside_a_drive_that_turns_is_a_steady_motion() -> None:
    rotor = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0]).body("disc", 5.0, inertia=[0.2, 0.2, 0.3])
    rotor.body("shaft", 1.0, inertia=[0.1, 0.1, 0.1])
    rotor.joint("tilt", "revolute", "base", "shaft", axis=[1, 0, 0], stiffness=7200)
    rotor.joint("spin", "revolute", "shaft", "disc", axis=[0, 0, 1], drive="100 * t")
    assert eomgen.build(rotor.build(), profile="instant").linearize().reference.what == "steady motion"


def test_about_an_equilibrium_found_before(driven: eomgen.Model) -> None:
    found = driven.equilibrium({"hinge": 3.0}, any_kind=True)
    lin = driven.linearize(at=found)
    assert lin.reference.what == "equilibrium"
    assert lin.modes().stability == "unstable"


def test_an_equilibrium_that_was_solved_is_not_solved_again(
    driven: eomgen.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = driven.equilibrium(t=0.25)
    before = driven.linearize(t=0.25).reference.q
    np.testing.assert_array_equal(before, found.q)
    found.q[:] = 1.0  # of the caller
    monkeypatch.setattr("eomgen.products.linear.analyses.operating_point.equilibrium", None)
    np.testing.assert_array_equal(driven.linearize(t=0.25).reference.q, before)
    for other in ({"t": 0.5}, {"t": 0.25, "any_kind": True}, {"t": 0.25, "initial": {"hinge": 0.1}}):
        with pytest.raises(TypeError, match="not callable"):
            driven.linearize(**other)


@pytest.mark.slow
def test_a_base_is_held_at_an_equilibrium() -> None:
    """The shaking base acts as a disturbance: a hanging pendulum's response to it is that of the textbook."""
    builder = eomgen.SceneBuilder("shaken").base(position=["0.3 * sin(5 * t)", 0, 0])
    builder.body("bob", 2.0, center_of_mass=[0, 0, -0.7]).joint("hinge", "revolute", "base", "bob", axis=[0, 1, 0])
    model = eomgen.build(builder.build(), profile="instant")
    lin = model.linearize(t=0.3)
    np.testing.assert_allclose(lin.reference.q, [0.0], atol=1e-12)
    assert lin.names.disturbances == ("base.acceleration[0]", "base.acceleration[1]", "base.acceleration[2]")
    np.testing.assert_allclose(lin.E0, [[2.0 * 0.7, 0.0, 0.0]], atol=1e-12)  # a turn about y moves the bob to -x
    np.testing.assert_allclose(lin.K0, [[2.0 * 9.81 * 0.7]], rtol=1e-12)
    space = lin.state_space()
    assert (space.B.shape, space.E.shape, space.C.shape) == ((2, 0), (2, 3), (0, 2))


def respond(model: eomgen.Model, source: str, output: str) -> object:
    return model.linearize().frequency_response([1.0], source, output)


CALLS: list[tuple[str, Callable[[eomgen.Model], Any], type[Exception], str]] = [
    ("driven", lambda m: m.linearize(v=[1.0]), UsageError, "linearize: v need the q of their state; try: q=..., or"),
    ("driven", lambda m: m.linearize([0.1], at="initial"), UsageError, "the state is given by q as well as by at or"),
    ("driven", lambda m: m.linearize(at="rest"), UsageError, "at = 'rest' is unknown; try: \"equilibrium\""),
    ("driven", lambda m: m.linearize(at=0.5), UsageError, "at = 0.5 is unknown; try: "),  # type: ignore[arg-type]
    ("driven", lambda m: m.linearize([[0.1], [0.2]]), UsageError, "q: one state is needed, not a batch of shape (2"),
    ("driven", lambda m: m.linearize([0.1, 0.2]), UsageError, "q: the shape is (2,), (..., 1) is needed"),
    ("driven", lambda m: m.linearize(base=np.zeros(19)), UsageError, "the base of this scene is at rest"),
    ("driven", lambda m: m.linearize(independent=3), UsageError, "independent: coordinates are a list of names, not"),
    ("driven", lambda m: m.linearize([0.1], independent=["hinj"]), UsageError, "there is no component 'hinj'"),
    (
        "driven",
        lambda m: respond(m, "force", "angle"),
        UsageError,
        "there is no input or disturbance 'force'; try: one",
    ),
    ("driven", lambda m: respond(m, "wind", "angel"), UsageError, "there is no output or state 'angel'; try: angle"),
    ("crank", lambda m: respond(m, "force", "main"), UsageError, "'force': the linear model has no input or disturb"),
    ("crank", lambda m: m.linearize([0.3, 0.1, 0.9]), UsageError, "the state does not meet the constraints: wrist"),
    ("crank", lambda m: m.linearize(m.initial_q, [1.0, 0.0, 0.0]), UsageError, "in its rate; try: q and v of"),
    ("crank", lambda m: m.linearize(m.initial_q, a=[1.0, 0.0, 0.0]), UsageError, "in its acceleration; try: no a, for"),
    ("crank", lambda m: m.linearize(independent=["main", "slide"]), UsageError, "constraints do not leave slide free"),
    ("rolling", lambda m: m.linearize(at="initial").M0, ModelError, "constraints leave 3 velocities and 5 coordinates"),
]


@pytest.mark.parametrize("name, call, kind, text", CALLS, ids=[text[:48] for *_, text in CALLS])
def test_messages(
    name: str, call: Callable[[eomgen.Model], Any], kind: type[Exception], text: str, request: pytest.FixtureRequest
) -> None:
    with pytest.raises(kind, match=re.escape(text)):
        call(request.getfixturevalue(name))


def test_partials_that_are_no_numbers_are_named() -> None:
    """Outputs by their rows, if the equations of motion have slopes."""
    names: Any = SimpleNamespace(outputs=("tilt", "twice", "far"))
    known = np.zeros((3, 2))
    for steep, said in (([0], "the output tilt is not"), ([0, 2], "the output tilt and of far is not")):
        blocks = {"K": np.zeros((2, 2)), "Yq": known.copy(), "Yv": known}
        _check_finite(blocks, names)
        blocks["Yq"][steep, 1] = np.inf
        with pytest.raises(NumericalError, match=f"linearize: the slope of {said} a finite number in this state"):
            _check_finite(blocks, names)
    for name in ("K", "J"):
        with pytest.raises(NumericalError, match=f"partials are not finite numbers in this state: {name}, Yq"):
            _check_finite({**blocks, name: np.full((2, 2), np.nan)}, names)


def test_an_inertia_matrix_without_inertia_along_coordinates_names_them() -> None:
    """The columns of the null space of a projection: the named coordinates are the large entries of its vector."""
    for null, named in (([0.0, 1.0, 0.0], "b"), ([1.0, 0.2, 0.05], "a, b"), ([1.0, 0.12, 0.09], "a, b")):
        unit = np.array(null) / np.linalg.norm(null)
        with pytest.raises(ModelError, match=f"the inertia matrix is singular along {named}, so there is no"):
            _solve(3.0 * (np.eye(3) - np.outer(unit, unit)), np.eye(3), ["a", "b", "c"])
    M = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.25], [0.0, 0.25, 4.0]])
    np.testing.assert_allclose(M @ _solve(M, M @ M, ["a", "b", "c"]), M @ M, atol=1e-14)
    assert _solve(np.zeros((0, 0)), np.zeros((0, 2)), []).shape == (0, 2)
    right = np.array([[2.0, 3.0], [5.0, 7.0]])
    np.testing.assert_array_equal(_solve(np.diag([4.0, 1e-9]), right, ["a", "b"]), right / [[4.0], [1e-9]])
    for light in (0.0, 1e-15, -1.0):
        with pytest.raises(ModelError, match="the inertia matrix is singular along b, so"):
            _solve(np.diag([4.0, light]), right, ["a", "b"])
    with pytest.raises(ModelError, match="the inertia matrix is singular along a, so"):
        _solve(np.zeros((2, 2)), right, ["a", "b"])
