"""Steady motions and their stability against closed forms: a top, a governor, a pendulum on a turning base, a spinning
body."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen import ModelError, NumericalError, UsageError
from eomgen.lie.product import Factor, bracket_matrix, difference, update
from eomgen.products.statics import steady_motion
from eomgen.products.statics.steady_search import _across
from eomgen.products.statics.symmetries import Fields, SymmetryField
from tests.oracles.evaluation import Array
from tests.simulation.rails import built

MASS, REACH, ACROSS, ALONG, G = 1.3, 0.25, 0.12, 0.03, 9.81  # of the top; ACROSS about the fixed point


def top() -> eomgen.Scene:
    """Return a symmetric top on a fixed point in Euler angles: precession, nutation, spin."""
    builder = eomgen.SceneBuilder("top").body("yoke", 0.0).body("ring", 0.0)
    about_center = ACROSS - MASS * REACH**2
    builder.body("top", MASS, center_of_mass=[0, 0, REACH], inertia=[about_center, about_center, ALONG])
    builder.joint("precession", "revolute", "base", "yoke", axis=[0, 0, 1])
    builder.joint("nutation", "revolute", "yoke", "ring", axis=[1, 0, 0], initial={"position": 0.3})
    return builder.joint("spin", "revolute", "ring", "top", axis=[0, 0, 1]).build()


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(top(), profile="instant")


def precessions(theta: float, spin: float) -> list[float]:
    """Return the roots of (A - C) cos(theta) p^2 - C s p + m g l = 0, from the balance of moments about the line of
    nodes."""
    return sorted(np.roots([(ACROSS - ALONG) * math.cos(theta), -ALONG * spin, MASS * G * REACH]).real)


@pytest.mark.parametrize("root", [0, 1], ids=["slow", "fast"])
def test_steady_precession_of_a_top(model: eomgen.Model, root: int) -> None:
    theta, spin = 0.6, 80.0
    expected = precessions(theta, spin)[root]
    start = {"precession": {"velocity": 0.9 * expected}}
    found = model.steady_motion({"spin": spin}, {"nutation": theta}, start)
    np.testing.assert_allclose(found.v, [expected, 0.0, spin], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(found.q[1], theta, rtol=1e-15)
    assert found.ignorable == ("v.precession", "v.spin")
    assert not found.undetermined and found.base is None and found.t == 0.0 and not np.any(found.a)
    assert found.acceleration < 1e-9 and 0 < found.iterations < 20 and len(found.multipliers) == 0
    said = f"steady after {found.iterations} steps, unbalanced acceleration {found.acceleration:.3g}"
    assert found.message == said and repr(found) == f"<SteadyMotion: {said}>"
    assert list(found.initial) == ["q", "v"] and found.initial["q"] is found.q

    lin = model.linearize(at=found)
    assert lin.reference.what == "steady motion"
    modes = lin.modes()
    # small nutation, with both momenta kept: A^2 p^2 w^2 = A^2 p^4 - 2 m g l A p^2 cos(theta) + (m g l)^2
    weight = MASS * G * REACH
    square = expected**2 - 2.0 * weight * math.cos(theta) / ACROSS + (weight / (ACROSS * expected)) ** 2
    np.testing.assert_allclose(modes.angular_frequency[-1], math.sqrt(square), rtol=1e-9)
    np.testing.assert_allclose(modes.damping_ratio[-1], 0.0, atol=1e-9)
    assert np.all(np.abs(modes.eigenvalues[:-1]) <= modes.uncertainty[:-1])
    assert modes.stability == "marginal"


def test_inclination_of_a_top_from_both_rates(model: eomgen.Model) -> None:
    slow = precessions(0.7, 90.0)[0]
    found = model.steady_motion({"spin": 90.0, "v.precession": slow}, initial={"nutation": 0.5})
    np.testing.assert_allclose(found.q[1], 0.7, rtol=1e-9)
    solution = model.simulate(1.0, 1e-3, initial=found.initial, method="rk4")
    np.testing.assert_allclose(solution.q[-1, 1], 0.7, rtol=0, atol=1e-9)


def test_what_is_left_open_is_named(model: eomgen.Model) -> None:
    found = model.steady_motion({"spin": 80.0}, initial={"nutation": 0.5, "precession": {"velocity": 1.3}})
    assert set(found.undetermined) == {"nutation", "v.precession"}
    assert "one more value could have been given, of nutation, v.precession" in found.message


REFUSED: dict[str, Callable[[eomgen.Model], Any]] = {
    "no steady motion was found in": lambda m: m.steady_motion({"spin": 10.0}, {"nutation": 0.6}),
    # a velocity that is given is not proposed
    "nearer to it, or velocities of coordinates on which nothing depends: v.precession": (
        lambda m: m.steady_motion({"spin": 20.0}, {"nutation": 0.6})
    ),
    "nearer to it, or v.nutation left out, for a force acts along it": (
        lambda m: m.steady_motion({"nutation": 2.0}, {"nutation": 0.6, "precession": 0.0})
    ),
    "there is no component 'spinn'; try: spin": lambda m: m.steady_motion({"spinn": 2.0}),
    "velocity spin: velocity spin is nan, not a finite number": lambda m: m.steady_motion({"spin": math.nan}),
    "velocity spin: one number is needed, not an array of": lambda m: m.steady_motion({"spin": [1.0, 2.0]}),
    'not list; try: velocities={"precession": 2.0}': lambda m: m.steady_motion([80.0]),
    "no coordinate or joint 'nutatoin'; try: nutation": lambda m: m.steady_motion({}, {"nutatoin": 0.1}),
    "t is nan, not a finite number": lambda m: m.steady_motion({}, t=math.nan),
    # upright, precession and spin turn about one axis
    "the inertia matrix is singular at the end of the search": (
        lambda m: m.steady_motion({"spin": 80.0}, initial={"nutation": 0.0})
    ),
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_steady_motion_is_named(model: eomgen.Model, text: str) -> None:
    with pytest.raises((NumericalError, UsageError, ModelError)) as caught:
        REFUSED[text](model)
    assert text in str(caught.value)


@pytest.mark.slow
def test_an_engine_that_holds_the_speed_determines_it() -> None:
    """A cart with the forces of an engine and of the air: a given speed is named as the one along which forces act."""
    cart = eomgen.SceneBuilder("cart").body("cart", 100.0, inertia=[10.0, 10.0, 10.0])
    cart.joint("road", "planar", "base", "cart", axis=[0, 0, 1], x_axis=[1, 0, 0], initial={"velocity": [0, 20, 0]})
    cart.force("engine", "cart", force=["500 * (20 - v.road[1]) - 2 * v.road[1]", "-3 * v.road[2]", 0])
    model = eomgen.build(cart.build(), profile="instant")
    np.testing.assert_allclose(model.steady_motion().v, [0.0, 500 * 20 / 502, 0.0], rtol=1e-12, atol=1e-12)
    with pytest.raises(NumericalError) as caught:
        model.steady_motion({"road[1]": 20.0})
    assert "v.road[1] accelerates with -0.4 m/s^2" in str(caught.value)
    assert str(caught.value).endswith("nearer to it, or v.road[1] left out, for a force acts along it")


@pytest.mark.slow
def test_sleeping_top_is_stable_above_the_critical_spin() -> None:
    """On a ball joint: C^2 s^2 > 4 A m g l."""
    builder = eomgen.SceneBuilder("sleeper")
    about_center = ACROSS - MASS * REACH**2
    builder.body("top", MASS, center_of_mass=[0, 0, REACH], inertia=[about_center, about_center, ALONG])
    model = built(builder.joint("ball", "spherical", "base", "top"))
    critical = 2.0 * math.sqrt(ACROSS * MASS * G * REACH) / ALONG
    for share, stability in ((0.95, "unstable"), (1.05, "marginal")):
        spin = share * critical
        modes = model.linearize(model.initial_q, [0.0, 0.0, spin]).modes()
        assert modes.stability == stability
        # seen from the world: A w^2 - C s w + m g l = 0; body axes turn with s, which shifts the frequencies
        rates = np.concatenate([modes.eigenvalues, modes.eigenvalues.conj()])
        for root in np.roots([ACROSS, -ALONG * spin, MASS * G * REACH]):
            assert np.min(np.abs(rates - 1j * (root - spin))) <= 1e-7 * spin


def governor() -> eomgen.SceneBuilder:
    """Return a spindle with two arms of point masses, each linked with a sleeve."""
    builder = eomgen.SceneBuilder("governor").body("spindle", 1.0, inertia=[0.1, 0.1, 0.05])
    builder.joint("spindle", "revolute", "base", "spindle", axis=[0, 0, 1])
    for name, side in (("left", 1), ("right", -1)):
        builder.body(name, 0.8, center_of_mass=[0, 0, -0.4])
        at = {"axis": [0, -1, 0], "position": [0.05 * side, 0, 0], "initial": {"position": 0.5 * side}}
        builder.joint(name, "revolute", "spindle", name, **at)
    builder.body("sleeve", 1.5, inertia=[0.01] * 3)
    builder.joint("sleeve", "prismatic", "spindle", "sleeve", axis=[0, 0, 1], initial={"position": -0.6})
    for name, side in (("left", 1), ("right", -1)):
        builder.point(f"ball_{name}", name, [0, 0, -0.4]).point(f"lug_{name}", "sleeve", [0.05 * side, 0, 0])
        builder.constraint(f"link_{name}", "distance", f"ball_{name}", f"lug_{name}", length=0.4)
    return builder


@pytest.mark.slow
def test_governor_with_closed_loops() -> None:
    """Rod and arm of one length l: m w^2 (e + l sin(x)) cos(x) = (m + M) g sin(x), the virtual work along the arm's
    angle x."""
    model = built(governor())
    arm, offset, ball, sleeve = 0.4, 0.05, 0.8, 1.5
    angle = 0.8
    speed = math.sqrt((ball + sleeve) * G * math.tan(angle) / (ball * (offset + arm * math.sin(angle))))
    found = model.steady_motion({"spindle": speed})
    np.testing.assert_allclose(found.q[1:3], [angle, -angle], rtol=1e-9)
    np.testing.assert_allclose(found.q[3], -2.0 * arm * math.cos(angle), rtol=1e-9)
    assert found.ignorable == ("v.spindle",)
    linear = model.linearize(at=found)
    assert len(linear.coordinates) == 2
    # in the angle x alone, spin momentum kept: mass 2 m l^2 + 4 M l^2 sin^2 x, by Routh's function
    momentum = (0.06 + 2.0 * ball * (offset + arm * math.sin(angle)) ** 2) * speed

    def slope(value: complex) -> complex:
        r, dr = offset + arm * np.sin(value), arm * np.cos(value)
        around = 0.06 + 2.0 * ball * r**2
        return -(momentum**2) * 2.0 * ball * r * dr / around**2 + 2.0 * (ball + sleeve) * G * arm * np.sin(value)

    stiffness = slope(angle + 1e-30j).imag / 1e-30
    inertia = 2.0 * ball * arm**2 + 4.0 * sleeve * arm**2 * math.sin(angle) ** 2
    np.testing.assert_allclose(slope(complex(angle)).real, 0.0, atol=1e-9)
    np.testing.assert_allclose(linear.modes().angular_frequency[-1], math.sqrt(stiffness / inertia), rtol=1e-8)


@pytest.mark.slow
def test_pendulum_on_a_base_that_turns() -> None:
    """cos(x) = g / (l w^2); small motions with w sin(x). A base that turns steadily is part of the default point."""
    speed, length = 7.0, 0.5
    builder = eomgen.SceneBuilder("turning").base(rotation=[([0, 0, 1], f"{speed} * t")])
    builder.body("bob", 2.0, center_of_mass=[0, 0, -length])
    builder.joint("hinge", "revolute", "base", "bob", axis=[0, 1, 0], initial={"position": 0.8})
    model = eomgen.build(builder.build(), profile="instant")
    angle = math.acos(G / (length * speed**2))
    lin = model.linearize(t=0.4)
    assert lin.reference.what == "steady motion"
    np.testing.assert_allclose(lin.reference.q, [angle], rtol=1e-10)
    np.testing.assert_allclose(lin.undamped_frequencies, [speed * math.sin(angle)], rtol=1e-10)
    upright = model.linearize(at="steady", initial={"hinge": 0.01})
    np.testing.assert_allclose(upright.reference.q, [0.0], atol=1e-10)
    np.testing.assert_allclose(upright.undamped_frequencies, [-math.sqrt(speed**2 - G / length)], rtol=1e-10)
    held = model.linearize(at="equilibrium")
    np.testing.assert_allclose(held.undamped_frequencies, [math.sqrt(G / length)], rtol=1e-10)


@pytest.mark.slow
def test_balance_at_an_instant_is_not_a_steady_motion() -> None:
    """A pendulum that passes its lowest point does not accelerate there, with any velocity."""
    builder = eomgen.SceneBuilder("swing").body("bob", 2.0, center_of_mass=[0, 0, -0.5])
    with pytest.raises(NumericalError) as caught:
        built(builder.joint("hinge", "revolute", "base", "bob", axis=[0, 1, 0])).steady_motion({"hinge": 3.0})
    said = str(caught.value)
    assert "balance at this instant only: later v.hinge acc" in said
    assert "try: centres of mass on the axis of hinge (the centre of bob is 0.5 m off, 1 kg m), with" in said


@pytest.mark.slow
@pytest.mark.parametrize(("count", "cause"), [(3, "gravity along the axis of spin or none"), (1, "centres of mass on")])
def test_gravity_across_the_axis_of_a_balanced_rotor_is_named(count: int, cause: str) -> None:
    builder = eomgen.SceneBuilder("blades", gravity=[0, 0, -9.81]).body("hub", 1.0, inertia=[1, 1, 1])
    builder.joint("spin", "revolute", "base", "hub", axis=[1, 0, 0])
    for k in range(count):
        turn = [([1, 0, 0], 2.0 * math.pi * k / 3.0)]
        builder.body(f"blade_{k}", 1.0, center_of_mass=[0, 0, 1.0], inertia=[0.1, 0.1, 0.01])
        builder.joint(f"lag_{k}", "revolute", "hub", f"blade_{k}", axis=[1, 0, 0], rotation=turn, stiffness=1e3)
    with pytest.raises(NumericalError) as caught:
        eomgen.build(builder.build(), profile="instant").steady_motion({"spin": 3.0})
    assert "forces balance at this instant only: later" in str(caught.value)
    assert f"try: {cause}" in str(caught.value)
    assert ("floquet (of a model, in Python) takes such a motion, with a drive of spin" in str(caught.value)) == (
        count > 1
    )


# -- fields and increments, of configurations alone --------------------------------------------------------------------

FACTORS = [Factor("R", "x", 0, 2, 0, 2), Factor("SO3", "ball", 2, 4, 2, 3), Factor("SE3", "body", 6, 7, 5, 6)]
NV = 11


def fields_of(rng: np.random.Generator, *, turning: bool) -> tuple[Fields, Array]:
    """Return three fields with constant parts, motions of frames and, if asked for, turns of both travels; and q."""
    every = []
    for _ in range(3):
        A = np.zeros((NV, NV))
        A[0, 1] = turning * rng.normal()
        A[1, 0] = -A[0, 1]
        e, xi = rng.normal(size=(2, NV))
        xi[:2] = 0.0
        every.append(SymmetryField(e, A, xi, A - bracket_matrix(FACTORS, e)))
    model: Any = SimpleNamespace(nv=NV, factors=FACTORS)
    q = update(FACTORS, np.array([0.3, -1.0, 1, 0, 0, 0, 1, 0, 0, 0, 0.2, 0.5, -0.7]), rng.normal(size=NV))
    return Fields(model, every), q


@pytest.mark.parametrize("turning", [False, True])
def test_motions_along_fields_have_their_velocities_slopes_and_rates(turning: bool, rng: np.random.Generator) -> None:
    fields, q = fields_of(rng, turning=turning)
    g, h = rng.normal(size=3), 1e-5
    assert len(fields) == 3 and fields.directions(q).shape == (NV, 3)
    along = fields.along(g)
    np.testing.assert_allclose(along.W, sum(w * field.W for w, field in zip(g, fields.every, strict=True)))
    for seconds in (0.0, 0.4, -1.3):
        here = fields.after(q, g, seconds)
        ends = [fields.after(q, g, seconds + sign * h) for sign in (-1.0, 1.0)]
        v = fields.directions(here) @ g
        np.testing.assert_allclose(difference(FACTORS, *ends) / (2.0 * h), v, atol=1e-8)
        # velocities of a symmetry change with W
        rates = [fields.directions(end) @ g for end in ends]
        np.testing.assert_allclose((rates[1] - rates[0]) / (2.0 * h), along.W @ v, atol=1e-7)
    for eta in rng.normal(size=(4, NV)):
        moved = [fields.directions(update(FACTORS, q, sign * h * eta)) @ g for sign in (-1.0, 1.0)]
        np.testing.assert_allclose(fields.slope(q, g) @ eta, (moved[1] - moved[0]) / (2.0 * h), atol=1e-7)
    assert Fields(fields.model, []).directions(q).shape == (NV, 0)


@pytest.mark.parametrize("held", [[], [2], [0, 3]])
def test_unknown_increments_are_orthogonal_to_the_fields_and_keep_what_is_held(
    held: list[int], rng: np.random.Generator
) -> None:
    root = rng.normal(size=(5, 5))
    M, X, mask = root @ root.T + np.eye(5), rng.normal(size=(5, 2)), np.isin(np.arange(5), held)
    across = _across(M, X, mask)
    assert not np.any(across[mask]) and np.linalg.matrix_rank(across) == across.shape[1]
    # motions along the fields that change no held component
    values = np.linalg.svd(X[mask])[1] if held else np.zeros(0)
    left = X @ np.linalg.svd(X[mask])[2][np.sum(values > 1e-9) :].T if held else X
    assert across.shape[1] == 5 - len(held) - left.shape[1]
    np.testing.assert_allclose(across.T @ M @ left, 0.0, atol=1e-9)


@pytest.mark.parametrize(("indefinite", "beams"), [(True, ["rope"]), (True, []), (False, ["rope"]), (False, [])])
def test_a_singular_inertia_is_of_the_end_unless_beams_bend_too_far_at_the_start(
    indefinite: bool, beams: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    start = SimpleNamespace(text="too far at the start", hint="less")
    monkeypatch.setattr(steady_motion, "inertia_warning", lambda *_, where: start if indefinite else None)
    monkeypatch.setattr(steady_motion, "beams_beyond_linear_range", lambda *_: beams)
    said = str(steady_motion._not_positive_definite(cast(Any, None), np.zeros(1), np.zeros(0)))
    assert ("too far at the start; try: less" in said) == (indefinite and bool(beams))
    assert ("singular at the end of the search" in said) != (indefinite and bool(beams))
