"""Static equilibrium against deflections, hanging chains and minima of energy; what has none is refused with the
coordinate."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

import eomgen
from eomgen.compiled.rest import equilibrium
from eomgen.compiled.rest.sparse_partials import sparse_partials
from eomgen.lie import product
from eomgen.solvers.phi_functions import phi
from tests.models.scenes import INERTIA, LENGTH, MASS, PENDULUM_TOML, absolute, breaking, flyer, pendulum

EXAMPLES = Path(__file__).parents[2] / "examples"
G = 9.81


@cache
def two_masses() -> eomgen.Model:
    """Return two masses on springs, one on the other, whose springs are slack at zero."""
    builder = eomgen.SceneBuilder("two_masses").parameter("load", 3.0, tunable=True, unit="kg").input("push", unit="N")
    builder.body("lower", 2.0).joint(
        "lower", "prismatic", "base", "lower", axis=[0, 0, 1], stiffness=500.0, damping=20.0
    )
    builder.body("upper", "load").joint(
        "upper", "prismatic", "lower", "upper", axis=[0, 0, 1], stiffness=200.0, damping=20.0
    )
    builder.effort("push", "upper", "push").simulation(start="equilibrium", duration=1.0)
    return eomgen.build(builder.build(), profile="quick")


@cache
def rods(count: int) -> eomgen.Model:
    """Return a chain of rods of length 1/count, its ends 0.6 apart on the level, closed by a pin across its plane."""
    builder = eomgen.SceneBuilder(f"rods_{count}")
    length = 1.0 / count
    for k in range(count):
        builder.body(
            f"rod{k}", length, center_of_mass=[length / 2, 0, 0], inertia=[1e-6, length**3 / 12, length**3 / 12]
        )
        angle = 0.9 if k == 0 else -1.8 / (count - 1)
        held = {"axis": [0, 1, 0], "position": [length if k else 0.0, 0, 0], "initial": {"position": angle}}
        builder.joint(f"pin{k}", "revolute", f"rod{k - 1}" if k else "base", f"rod{k}", **held)
    first = {"body": "base", "position": [0.6, 0, 0], "axis": [0, 1, 0]}
    builder.constraint("end", "point_on_line", first, {"body": f"rod{count - 1}", "position": [length, 0, 0]})
    return eomgen.build(builder.build(), profile="quick")


# -- closed forms ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_deflections_and_frequencies_of_springs_under_weight() -> None:
    model = two_masses()
    found = model.equilibrium(u={"push": -7.0})
    upper = -(3.0 * G + 7.0) / 200.0
    np.testing.assert_allclose(found.q, [-5.0 * G / 500.0, upper], rtol=1e-13)  # the push is between the masses
    assert np.array_equal(found.v, [0.0, 0.0]) and found.stable and not found.undetermined
    M, K = np.array([[5.0, 3.0], [3.0, 3.0]]), np.diag([500.0, 200.0])
    np.testing.assert_allclose(found.frequencies**2, np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real), rtol=1e-12)
    heavier = model.equilibrium(parameters={"load": 6.0}, u={"push": 0.0})
    np.testing.assert_allclose(heavier.q, [-8.0 * G / 500.0, -6.0 * G / 200.0], rtol=1e-13)
    assert found.residual < 1e-12 and found.acceleration < 1e-12


@pytest.mark.slow
def test_a_pendulum_hangs_or_stands() -> None:
    model, rest = pendulum(), {"torque": 0.0}
    rate = np.sqrt(MASS * G * LENGTH / (INERTIA + MASS * LENGTH**2))
    for angle in (0.4, 1.7, 3.0, np.pi):
        hanging = model.equilibrium({"hinge": angle}, u=rest)
        assert np.sin(hanging.q[0]) == pytest.approx(0.0, abs=1e-12) and np.cos(hanging.q[0]) == pytest.approx(1.0)
        assert hanging.stable and hanging.frequencies == pytest.approx([rate])
    for angle in (2.9, np.pi):
        standing = model.equilibrium({"hinge": angle}, u=rest, any_kind=True)
        assert standing.q == pytest.approx([np.pi]) and standing.stable is False
        assert standing.frequencies == pytest.approx([-rate])
        assert f"unstable along v.hinge: it would leave with e^({rate:.3g} t)" in standing.message
    held = model.equilibrium(u={"torque": 2.0})
    assert np.sin(held.q[0]) * MASS * G * LENGTH == pytest.approx(2.0, rel=1e-12)


@pytest.mark.slow
def test_a_chain_of_rods_hangs_by_its_polygon_of_forces_and_nears_the_catenary() -> None:
    depths = []
    for count in (6, 12):
        found = rods(count).equilibrium()
        slopes = np.arange(count) - (count - 1) / 2  # weight between a rod and the middle, in rods
        pull = brentq(lambda H, s=slopes: np.sum(np.cos(np.arctan(s / H))) / len(s) - 0.6, 1e-3, 1e3)
        expected = np.arctan(-slopes / pull)  # positive angles point down
        np.testing.assert_allclose(np.cumsum(found.q), expected, atol=1e-10)
        assert found.stable and found.acceleration < 1e-8
        depths.append(np.max(np.cumsum(np.sin(np.cumsum(found.q))) / count))
    a = brentq(lambda a: 2.0 * a * np.sinh(0.3 / a) - 1.0, 0.05, 5.0)
    errors = np.abs(np.array(depths) - a * (np.cosh(0.3 / a) - 1.0))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def hinged(count: int, terms: Sequence[str] = ()) -> eomgen.Scene:
    """Return a chain of uniform rods of mass 1 and length 1/count on hinges, on the level at the start."""
    builder = eomgen.SceneBuilder(f"hinged_{count}", coordinates="joint", terms=terms)
    length = 1.0 / count
    for k in range(count):
        builder.body(f"rod{k}", 1.0, center_of_mass=[0.5 * length, 0, 0], inertia=[1e-9, *[length**2 / 12.0] * 2])
        held = {"axis": [0, 1, 0], "position": [length if k else 0.0, 0, 0]}
        builder.joint(f"pin{k}", "revolute", f"rod{k - 1}" if k else "base", f"rod{k}", **held)
    return builder.build()


@pytest.mark.slow
def test_partials_by_the_recursion_of_a_tree_are_those_of_the_whole_equations(rng: np.random.Generator) -> None:
    count = 40
    by_recursion = eomgen.build(hinged(count), profile="quick")
    assert "X" in by_recursion.library.layout["patterns"]
    whole = eomgen.build(hinged(count, ["partials", "velocity_partials", "mass"]), profile="quick")
    q, v, a = rng.normal(size=(3, count))
    given: dict[str, Any] = {"t": 0.0, "parameters": by_recursion.parameter_array({}), "base": None}
    found = sparse_partials(by_recursion, q, v, a, np.zeros(0), np.zeros(0), given)
    K = whole.evaluate("partials", q, v, a)["K"]
    np.testing.assert_allclose(found.K, K, rtol=1e-10, atol=1e-12 * np.max(np.abs(K)))
    np.testing.assert_allclose(found.M, whole.mass(q), rtol=1e-10)


@pytest.mark.slow
def test_the_base_is_held_where_it_is() -> None:
    data = tomllib.loads(PENDULUM_TOML)
    data |= {"name": "tilted"}
    data["base"] = {"position": ["0.2 * sin(40 * t)", 0, 0], "rotation": [{"axis": [0, 1, 0], "angle": "0.3 * t"}]}
    model = eomgen.build(data, profile="quick")
    assert model.equilibrium(t=1.0, u={"torque": 0.0}).q == pytest.approx([-0.3], abs=1e-12)
    assert model.equilibrium(t=2.0, u={"torque": 0.0}).q == pytest.approx([-0.6], abs=1e-12)


# -- energy, constraints, groups ---------------------------------------------------------------------------------------


def suspended() -> eomgen.Model:
    """Return a body in space that hangs on four springs, with a ball-jointed weight below it."""
    builder = eomgen.SceneBuilder("suspended")
    builder.body("frame", 4.0, center_of_mass=[0.02, 0.01, 0.03], inertia=[0.3, 0.4, 0.5])
    builder.body("weight", 1.0, center_of_mass=[0.0, 0.0, -0.3], inertia=[0.02, 0.02, 0.01])
    away = {"position": [0.3, -0.2, -0.4], "orientation": [np.cos(0.4), np.sin(0.4), 0.0, 0.0]}
    builder.joint("root", "free", "base", "frame", initial=away)
    builder.joint("ball", "spherical", "frame", "weight", initial={"position": [np.cos(1.0), 0.0, np.sin(1.0), 0.0]})
    for k, (x, y) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        builder.point(f"roof{k}", "base", [1.2 * x, 1.1 * y, 1.0]).point(f"ear{k}", "frame", [0.4 * x, 0.3 * y, 0.1])
        builder.spring(f"cord{k}", f"roof{k}", f"ear{k}", stiffness=80.0 + 10 * k, length=0.8)
    return eomgen.build(builder.build(), profile="quick")


def lowest(model: eomgen.Model, found: equilibrium.Equilibrium, directions: np.ndarray) -> np.ndarray:
    """Return how much higher the potential energy is at configurations nearby."""
    q = product.update(model.factors, np.broadcast_to(found.q, (len(directions), model.nq)), directions)
    rest = np.zeros(model.nv)
    energy = model.energy(q, rest, rest, 0.0)["potential"]
    return energy - model.energy(found.q, rest, rest, 0.0)["potential"]


@pytest.mark.slow
def test_a_body_in_space_on_springs_is_where_its_energy_is_least() -> None:
    model = suspended()
    found = model.equilibrium()
    assert found.stable and found.iterations < 40 and found.acceleration < 1e-9
    assert list(found.undetermined) == ["v.ball[2]"]
    np.testing.assert_allclose(model.forward_dynamics(found.q, found.v), 0.0, atol=1e-8)
    directions = 1e-3 * np.random.default_rng(3).normal(size=(60, model.nv))
    assert np.all(lowest(model, found, directions) > 0.0)
    small = lowest(model, found, 0.1 * directions)
    np.testing.assert_allclose(small * 100.0, lowest(model, found, directions), rtol=0.05)  # a minimum, not a slope


@pytest.mark.slow
def test_a_loop_rests_at_its_least_energy_with_its_multipliers() -> None:
    model = eomgen.build(EXAMPLES / "four_bar" / "scene.toml")
    found = model.equilibrium()
    assert found.stable and np.max(np.abs(model.evaluate("constraint", found.q)["Phi"])) < 1e-12
    vdot, lam = model.constrained_dynamics(found.q, found.v)
    np.testing.assert_allclose(vdot, 0.0, atol=1e-9)
    np.testing.assert_allclose(lam, found.multipliers, atol=1e-9)
    rest, energies = np.zeros(model.nv), []
    for angle in (-0.02, -0.01, 0.01, 0.02):
        moved = model.consistent(found.q + np.array([angle, 0.0, 0.0]), rest).q
        energies.append(model.energy(moved, rest, rest)["potential"] - model.energy(found.q, rest, rest)["potential"])
    assert all(energy > 0.0 for energy in energies)
    other = model.equilibrium(any_kind=True)
    assert other.stable is False and other.frequencies[0] < 0.0


@pytest.mark.slow
def test_internal_states_rest_too() -> None:
    data = tomllib.loads(PENDULUM_TOML)
    data |= {"name": "servo", "states": {"sum": {"rate": "0.7 - q.hinge"}, "lag": {"rate": "(40 * sum - lag) / 0.05"}}}
    data["efforts"]["motor"]["effort"] = "30 * (0.7 - q.hinge) + lag"
    model = eomgen.build(data, profile="quick")
    found = model.equilibrium()
    holding = MASS * G * LENGTH * np.sin(0.7)
    assert found.q == pytest.approx([0.7], abs=1e-10)
    np.testing.assert_allclose(found.z, [holding / 40.0, holding], rtol=1e-9)
    assert found.stable is None
    assert "stiffness alone does not decide it: internal states take part" in found.message
    at_rest = {"hinge": {"position": 0.4, "velocity": 0.0}}
    run = model.simulate(0.2, 1e-3, start="equilibrium", initial=at_rest, parameters={"shake": 0.0})
    np.testing.assert_allclose(run.q, 0.7, atol=1e-7)


# -- runs that start settled -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_scene_starts_at_equilibrium() -> None:
    model = two_masses()
    run = model.simulate(inputs={"push": -7.0}, parameters={"load": 4.0})
    rest = np.array([-6.0 * G / 500.0, -(4.0 * G + 7.0) / 200.0])
    np.testing.assert_allclose(run.q - rest, 0.0, atol=1e-12)
    assert run.metadata["corrections"][0].startswith("initial position: at rest after ")
    assert run.metadata["start"] == "the scene's equilibrium"
    as_said = model.simulate(0.1, 1e-3, start="initial", inputs={"push": 0.0})
    assert np.array_equal(as_said.q[0], [0.0, 0.0]) and as_said.metadata["corrections"] == []
    given = model.simulate(0.1, 1e-3, initial={"upper": 0.05}, inputs={"push": 0.0})
    assert np.array_equal(given.q[0], [0.0, 0.05])
    assert as_said.metadata["start"] == "the scene's initial state, not its equilibrium"
    assert given.metadata["start"] == "initial values given, in place of the scene's equilibrium"
    moving = {"upper": {"position": 0.05, "velocity": 0.3}}
    settled = model.simulate(0.1, 1e-3, initial=moving, start="equilibrium", inputs={"push": 0.0})
    assert settled.q[0, 1] == pytest.approx(-3.0 * G / 200.0) and np.array_equal(settled.v[0], [0.0, 0.3])
    assert settled.metadata["start"] == "equilibrium near the initial values given"
    with pytest.raises(eomgen.UsageError, match="start: a run cannot start at 'rest'; try: initial or equilibrium"):
        model.simulate(0.1, 1e-3, start="rest")


# -- what has no equilibrium -------------------------------------------------------------------------------------------


# -- the command line --------------------------------------------------------------------------------------------------


REFUSED: dict[str, Callable[[], object]] = {
    r"the terms mass, partials, residual are needed.*terms=\[\.\.\., 'mass'": lambda: eomgen.build(
        EXAMPLES / "quarter_car" / "scene.toml", terms=["forward_dynamics"]
    ).equilibrium(),
    "one set of parameters is needed, not a batch": lambda: two_masses().equilibrium(parameters={"load": [1.0, 2.0]}),
    "t: t is nan, not a finite number": lambda: two_masses().equilibrium(t=float("nan")),
    r"nothing holds v\.root\[\d\]: it accelerates with .* m/s\^2, and no": lambda: flyer().equilibrium(),
    r"nothing holds v\.\w+\[\d\]: .* try: a spring, a stop, a constraint": lambda: absolute().equilibrium(),
    r"nothing holds v\.slide: it accelerates with 0\.707\d* m/s\^2": lambda: breaking().equilibrium(),
    r"the force along v\.slide is not a finite number at the initial state": lambda: breaking().equilibrium(t=0.6),
    r"no equilibrium was found in \d+ steps: v\.hinge still": lambda: pendulum().equilibrium(u={"torque": 50.0}),
    "the inertia matrix at the initial state is not positive definite": lambda: eomgen.build(
        replace(two_masses().scene, requirements=()),
        profile="quick",  # which would refuse a mass that a URDF may have
    ).equilibrium(parameters={"load": -4.0}),
}


@pytest.mark.slow
@pytest.mark.parametrize("said", REFUSED)
def test_what_has_no_equilibrium_is_named(said: str) -> None:
    with pytest.raises((eomgen.UsageError, eomgen.NumericalError, eomgen.ModelError), match=said):
        REFUSED[said]()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_functions_of_exponential_steps_are_right_to_rounding_at_all_sizes(order: int) -> None:
    x = np.concatenate([-np.logspace(-12, 6, 60), np.logspace(-12, 2.5, 60), [0.0, 1.0, -1.0]])
    expected = []
    with mpmath.workdps(90):
        for value in map(mpmath.mpf, x.tolist()):
            rest = mpmath.exp(value) - sum(value**k / mpmath.factorial(k) for k in range(order))
            expected.append(float(rest / value**order if value else 1 / mpmath.factorial(order)))
    np.testing.assert_allclose(phi(x, order), expected, rtol=2e-15)


# -- words, from numbers that are given --------------------------------------------------------------------------------
