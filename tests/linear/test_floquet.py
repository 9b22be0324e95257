"""Floquet multipliers against independent integrations, known borders of stability, and linear models that are
constant."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

import eomgen
from eomgen.errors import ModelError, NumericalError, UsageError
from eomgen.products.linear.floquet import Floquet, monodromy, multipliers
from tests.models.library import scene


def integrated(A: Any, period: float) -> np.ndarray:
    """Return the monodromy matrix of X' = A(t) X by the pair of Dormand and Prince of order 8."""
    n = len(A(0.0))
    run = solve_ivp(
        lambda t, x: (A(t) @ x.reshape(n, n)).ravel(),
        (0.0, period),
        np.eye(n).ravel(),
        "DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    return np.asarray(run.y[:, -1].reshape(n, n))


def in_order(values: np.ndarray) -> np.ndarray:
    """Return complex numbers in an order that does not depend on rounding."""
    return values[np.lexsort((np.round(values.imag, 6), np.round(values.real, 6)))]


@pytest.fixture(scope="module")
def mathieu() -> eomgen.Model:
    """Return x'' + c x' + (d + 2 e cos 2 t) x = 0."""
    builder = eomgen.SceneBuilder("mathieu", gravity=[0, 0, 0]).body("mass", 1.0)
    for name, value in (("d", 1.2), ("e", 0.3), ("c", 0.0)):
        builder.parameter(name, value, tunable=True)
    builder.joint("x", "prismatic", "base", "mass", axis=[1, 0, 0])
    builder.effort("spring", "x", "-(d + 2 * e * cos(2 * t)) * q.x - c * v.x")
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.2, 0.7])
def test_the_equation_of_mathieu_is_unstable_between_its_characteristic_values(mathieu: eomgen.Model, e: float) -> None:
    low, high = sorted((float(mathieu_b(1, e)), float(mathieu_a(1, e))))
    verdicts = [
        mathieu.floquet(math.pi, parameters={"d": d, "e": e, "c": 0.0}).stability
        for d in (low - 1e-3, low + 1e-3, high - 1e-3, high + 1e-3)
    ]
    assert verdicts == ["marginal", "unstable", "unstable", "marginal"]
    assert mathieu.floquet(math.pi, parameters={"d": high + 0.01, "e": e, "c": 0.05}).stability == "stable"


@pytest.mark.parametrize("count", [4, 8])
def test_collocation_is_of_order_8_and_damps_fast_decay(count: int) -> None:
    fast = np.array([np.diag([-1e4, -1.0])] * (6 * count + 1))
    assert abs(monodromy(fast, 1.0)[0, 0]) <= 1.0 and monodromy(fast, 1.0)[1, 1] == pytest.approx(math.exp(-1), 1e-9)
    A = np.array([[-0.1, 2.0], [-3.0, 0.2]])
    errors = [
        np.abs(monodromy(np.array([A] * (6 * n + 1)), 4.0) - scipy.linalg.expm(4.0 * A)).max()
        for n in (count, 2 * count)
    ]
    assert errors[0] / errors[1] == pytest.approx(2.0**8, rel=0.3)


def pendulum(coordinates: str) -> eomgen.Model:
    """Return a damped pendulum on a pivot that moves along an ellipse in pi seconds."""
    rod = {"mass": 1, "center_of_mass": [0, 0, -1], "inertia": [0.1, 0.1, 0.1]}
    pivot = {"position": ["0.2 * sin(2 * t)", "0", "0.1 * cos(4 * t)"]}
    hinge = {"joints__hinge__damping": 0.4, "joints__hinge__initial": {"position": 0.3}}
    data = scene("pendulum", coordinates=coordinates, bodies__rod=rod, base=pivot, outputs=None, **hinge)
    return eomgen.build(data, profile="instant")


@pytest.mark.slow
def test_a_periodic_motion_is_found_and_its_multipliers_are_differences_of_runs() -> None:
    model, h = pendulum("joint"), 1e-5
    result = model.floquet(math.pi, tolerance=1e-9)
    assert result.corrections > 0 and result.stability == "stable"

    def end(change: np.ndarray) -> np.ndarray:
        start = {"q": result.q + change[:1], "v": result.v + change[1:]}
        run = model.simulate(math.pi, math.pi / 50, method="rk45", tolerance=1e-12, error_estimate=False, initial=start)
        return np.concatenate([run.q[-1], run.v[-1]])

    np.testing.assert_allclose(end(np.zeros(2)), np.concatenate([result.q, result.v]), atol=1e-7)
    columns = [(end(h * unit) - end(-h * unit)) / (2.0 * h) for unit in np.eye(2)]
    np.testing.assert_allclose(np.array(columns).T, result.monodromy, atol=1e-7)


@pytest.mark.slow
def test_constraints_leave_the_multipliers_of_the_joint() -> None:
    expected = pendulum("joint").floquet(math.pi)
    result = pendulum("absolute").floquet(math.pi)
    np.testing.assert_allclose(in_order(result.multipliers), in_order(expected.multipliers), atol=1e-7)


def test_refusals(mathieu: eomgen.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.linear.analyses.periodic_motions._LAST", 8)
    for call, error, text in (
        (lambda: mathieu.floquet(0.0), UsageError, r"period: 0\.0 is not a positive number"),
        (lambda: mathieu.floquet(math.pi, tolerance=-1), UsageError, r"the tolerance must lie in 0\.\.0\.1, not -1"),
        (lambda: mathieu.floquet(math.pi, tolerance=0.1), UsageError, r"the tolerance must lie in 0\.\.0\.1, not 0\.1"),
        (lambda: mathieu.floquet(1e-6), NumericalError, r"the equations do not change within 1e-06 s, and the coef"),
        (
            lambda: mathieu.floquet(1.0),
            NumericalError,
            "the equations do not have the period 1 s: the coeff",
        ),
        (lambda: mathieu.floquet(math.pi, tolerance=1e-300), NumericalError, "the monodromy matrix is known to "),
    ):
        with pytest.raises(error, match=text):
            call()


def sliding(axis: list[int], gravity: float = 0.0, **joint: Any) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("sliding", gravity=[0, 0, gravity]).body("mass", 1.0)
    return builder.joint("x", "prismatic", "base", "mass", axis=axis, **joint)


SWINGING, OFF = {"stiffness": 39.47841760435743, "initial": {"position": 0.1}}, {"initial": {"position": 2.0}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("builder", "text"),
    [
        (sliding([0, 0, 1], -9.81), r"the motion is not periodic: in 1 s v\.x changes by -9\.81; try: the"),
        (sliding([1, 0, 0], **SWINGING).event("middle", "q.x"), "has an event, middle, at which deviations"),
        (sliding([1, 0, 0], **OFF).effort("away", "x", "20 * q.x**3"), "floquet: the motion ends early: "),
    ],
    ids=["falling", "event", "runaway"],
)
def test_motions_that_do_not_return_are_refused(builder: eomgen.SceneBuilder, text: str) -> None:
    with pytest.raises((ModelError, NumericalError), match=text):
        eomgen.build(builder.build(), profile="instant").floquet(1.0)


def test_a_picture_names_the_model_and_the_frequencies_of_pairs() -> None:
    values = np.array([np.exp(0.9j), np.exp(-0.9j), np.exp(0.905j), np.exp(-0.905j), 1e-9, 2e-9, 0.5])
    rest = {"monodromy": np.eye(7), "states": (), "uncertainty": np.full(7, 1e-9), "error": 1e-9}
    result = Floquet(2.0, multipliers=values, q=np.zeros(1), v=np.zeros(1), z=np.zeros(0), name="rotor", **rest)
    (axis,) = result.plot(Figure().subplots())
    assert axis.get_title(loc="left") == (
        "rotor: multipliers over 2 s: marginal\nfrequencies are known but for multiples of 0.5 Hz"
    )
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["unit circle: stable inside"]
    labels = {text.get_text(): tuple(np.round(text.xy, 2)) for text in axis.texts}
    assert labels == {"0.0716 Hz": (0.62, 0.78), "0.072 Hz": (0.62, 0.79)}


def test_a_start_beside_the_periodic_motion_is_corrected_and_progress_is_told(mathieu: eomgen.Model) -> None:
    """The equation is linear, so rest is one correction away; multipliers are an independent integration's."""
    told: list[tuple[int, int]] = []
    d, e, c = 1.2, 0.3, 0.5
    given = {"parameters": {"d": d, "e": e, "c": c}, "initial": {"x": {"position": 0.2, "velocity": -0.1}}}
    result = mathieu.floquet(math.pi, progress=lambda done, total: told.append((done, total)), **given)
    assert told == sorted(told) and told[0][0] == 0 and all(done < total for done, total in told)
    assert result.corrections == 1 and result.stability == "stable" and result.name == "mathieu"
    assert abs(result.q[0]) < 1e-8 and abs(result.v[0]) < 1e-8 and result.period == math.pi
    expected = integrated(lambda t: np.array([[0.0, 1.0], [-(d + 2.0 * e * math.cos(2.0 * t)), -c]]), math.pi)
    np.testing.assert_allclose(result.monodromy, expected, atol=3e-6)
    assert result.states == ("x", "v.x") and result.error < 1e-6
    np.testing.assert_allclose(np.prod(result.multipliers), math.exp(-c * math.pi), rtol=1e-6)
    off = np.abs(in_order(result.multipliers) - in_order(np.linalg.eigvals(expected).astype(complex)))
    assert np.all(off <= np.sort(result.uncertainty)[::-1] + 1e-9)
    later = mathieu.floquet(math.pi, t_start=0.7, parameters=given["parameters"])
    shifted = integrated(lambda t: np.array([[0.0, 1.0], [-(d + 2.0 * e * math.cos(2.0 * t + 1.4)), -c]]), math.pi)
    np.testing.assert_allclose(later.monodromy, shifted, atol=3e-6)


# -- results, from numbers alone ---------------------------------------------------------------------------------------


def result_of(values: list[complex], uncertainty: float = 1e-6) -> Floquet:
    """Return the result of a motion of period 0.5 s with given multipliers."""
    several = np.array(values, complex)
    empty, bounds = np.zeros(0), np.full(len(values), uncertainty)
    names = tuple(f"x{k}" for k in range(len(values)))
    return Floquet(0.5, np.diag(several.real), names, several, bounds, 1e-9, empty, empty, empty)


def test_exponents_and_frequencies_are_logarithms_over_the_period() -> None:
    exponents = np.array([-0.3 + 4.0j, -0.3 - 4.0j, -2.0])
    result = result_of(np.exp(0.5 * exponents).tolist())
    np.testing.assert_allclose(result.exponents, exponents, rtol=1e-14)
    np.testing.assert_allclose(result.frequencies, [2.0 / math.pi, 2.0 / math.pi, 0.0], rtol=1e-14)
    size = math.exp(-0.15)
    pair = f"{size * math.cos(2.0):.9g} ± {size * math.sin(2.0):.9g}j"
    assert result.rows == [
        (pair, f"{size:.9g}", "1e-06", "-0.3", f"{2.0 / math.pi:.6g}"),
        (f"{math.exp(-1.0):.9g}", f"{math.exp(-1.0):.9g}", "1e-06", "-2", "0"),
    ]
    assert f"<Floquet: 3 multipliers over 0.5 s; stable; largest multiplier {size:.9g}, error 1e-09>" == repr(result)
    assert "whole multiples of 2 Hz" in result._repr_html_()


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ([1.0 + 0.9e-6, 0.5], "marginal"),
        ([1.0 + 1.1e-6, 0.5], "unstable"),
        ([1.0 - 0.9e-6, 0.5], "marginal"),
        ([1.0 - 1.1e-6, 0.5], "stable"),
        ([-1.1, 0.5], "unstable"),
        ([1.0j, -1.0j], "marginal"),
        ([], "stable"),
    ],
)
def test_stability_is_told_up_to_the_uncertainty(values: list[complex], verdict: str) -> None:
    result = result_of(values)
    assert result.stability == verdict
    (axis,) = result.plot(Figure().subplots())
    circle, within, outside = axis.lines
    assert np.hypot(*circle.get_data()) == pytest.approx(1.0) and len(circle.get_xdata()) == 361
    assert len(outside.get_xdata()) == (verdict == "unstable")
    assert len(within.get_xdata()) + len(outside.get_xdata()) == len(values)


EPSILON = float(np.finfo(float).eps)


@pytest.mark.parametrize(
    ("half", "quarter", "off"),
    [
        (1e-6, 1e-4 + 1e-6, 1e-8),  # errors fall by a hundred: once more
        (1e-6, 1.0, 1e-6 * 2.0**-8),  # by 2^8 at the most
        (1e-6, 1.5e-6, 1e-6),  # not at all
        (1e-6, 1e-6, 1e-6),
        (1e-6, math.inf, 1e-6),
    ],
)
def test_errors_of_multipliers_fall_as_the_differences_do(half: float, quarter: float, off: float) -> None:
    """Of a symmetric matrix, whose multipliers change no more than the matrix does."""
    matrix = np.diag([0.25, 0.5])
    values, bounds, error = multipliers(matrix, *(matrix + np.diag([by, by]) for by in (half, quarter)))
    assert values.tolist() == [0.5, 0.25]
    np.testing.assert_allclose(bounds, off + 16.0 * EPSILON, rtol=1e-6)
    assert error == pytest.approx(off, rel=1e-6)


def test_double_multipliers_are_uncertain_by_the_root_of_the_change() -> None:
    matrix = np.array([[0.5, 0.4], [0.0, 0.5]])
    other = matrix + 1e-8 * np.eye(2)
    _, bounds, _ = multipliers(matrix, other, other)
    np.testing.assert_allclose(bounds, 1e-4, rtol=1e-3)
    values, _, _ = multipliers(*[np.array([[0.0, -2.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, -3.0]])] * 3)
    np.testing.assert_allclose(values, [-3.0, 1.0j, -1.0j], atol=1e-14)  # the largest first, then upper ones
    assert multipliers(*[np.zeros((0, 0))] * 3)[2] == 0.0
