"""The generated C steppers against the NumPy ones, published numbers and closed forms."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.generalized_alpha_cases import hht, newmark
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.integrators.stepper_layout import default_settings
from eomgen.lie import numeric, product
from eomgen.lie.groups import SE3
from tests.anchors import anchor
from tests.integrators.stepper_models import (
    EDGE_PARAMETERS,
    PROGRAMS,
    build,
    edge,
    free_motion,
    heavy_top,
    rotation,
    tied_body,
)
from tests.oracles.stepper import integrate

ALPHA, RKMK = GeneralizedAlpha(0.9), RUNGE_KUTTA_MUNTHE_KAAS_4
METHODS = pytest.mark.parametrize("method", [ALPHA, RKMK], ids=["alpha", "rkmk"])
TIED = {"p_damping": 0.3}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Compile each combination once per module."""
    known = {}

    def get(model, method, parameters=None, flags=()):
        key = (model.name, len(model.v), method.family, *flags)
        if key not in known:
            known[key] = build(tmp_path_factory.mktemp(model.name), model, method, parameters, flags)
        stepper = known[key]
        stepper.workspace[:] = 0.0
        stepper.settings = default_settings(stepper.program.method)
        stepper.parameters[: len(parameters or {})] = list((parameters or {}).values())
        return stepper

    return get


def rows_of(path):
    return np.hstack([path.t[1:, None], path.q[1:], path.v[1:], path.vdot[1:]])


@pytest.mark.slow_except("heavy_top-rkmk")
@METHODS
@pytest.mark.parametrize("make", [heavy_top, tied_body])
def test_c_gives_what_numpy_gives(built, method, make):
    model = make()
    stepper = built(model, method, TIED if make is tied_body else None)
    assert stepper.initialize(model.q, model.v, step=2.0**-10).status == 0
    outcome = stepper.run(100)
    expected = rows_of(integrate(model.equations, method, model.q, model.v, 2.0**-10, 100))
    assert (outcome.status, outcome.text, len(outcome.rows)) == (0, "ok", 100)
    scale = np.maximum(1.0, np.abs(expected).max(axis=0))
    assert np.abs((outcome.rows - expected) / scale).max() <= 1e-12


@pytest.mark.slow
def test_a_named_case_gives_what_numpy_gives(tmp_path):
    model, method = tied_body(), GeneralizedAlpha(case=hht(alpha=0.2))
    stepper = build(tmp_path, model, method, TIED, ())
    assert list(stepper.settings)[1:5] == ["alpha_m", "alpha_f", "beta", "gamma"]
    stepper.initialize(model.q, model.v, step=2.0**-10)
    expected = rows_of(integrate(model.equations, method, model.q, model.v, 2.0**-10, 100))
    assert np.abs((stepper.run(100).rows - expected) / np.maximum(1.0, np.abs(expected).max(axis=0))).max() <= 1e-12
    assert stepper.initialize(model.q, model.v, step=1e-3, beta=0.0).text.startswith("a setting is out of its range")
    other = GeneralizedAlpha(case=newmark(0.25, 0.5))
    stepper.initialize(model.q, model.v, step=1e-3, **{name: float(value) for name, value in other.parameters.items()})
    expected = rows_of(integrate(model.equations, other, model.q, model.v, 1e-3, 50))
    assert stepper.run(50).rows == pytest.approx(expected, rel=1e-9, abs=1e-9)


#: Centre of mass of the fast heavy top at t = 1 s: DOP853 at 1e-13, held against two independent codes.
TOP_AT_1 = anchor("heavy_top_places").reference[:3]


@METHODS
def test_published_state_of_the_heavy_top(built, method):
    model, errors = heavy_top(), []
    counts, finest = ([11, 12, 13], 1.25e-3) if method is ALPHA else ([10, 11, 12], 6e-7)
    stepper = built(model, method)
    for count in counts:
        stepper.initialize(model.q, model.v, step=2.0**-count)
        q = stepper.run(2**count, every=2**count).rows[-1, 1:5]
        errors.append(np.linalg.norm(rotation(q)[:, 1] - TOP_AT_1))
    assert -np.polyfit(counts, np.log2(errors), 1)[0] == pytest.approx(
        method.order, abs=0.1 if method.order == 2 else 0.2
    )
    assert errors[-1] < finest


def test_one_factorization_serves_a_thousand_steps(built):
    model = heavy_top()
    stepper = built(model, ALPHA)
    stepper.initialize(model.q, model.v, step=1e-3)
    state = stepper.run(1000, every=1000).state
    assert state["factorizations"] <= 5
    assert state["newton_iterations"] <= 3200
    assert state["steps"] == 1000
    assert state["halvings"] == 0
    assert state["max_residual"] < 1e-3  # of terms of size 1e4, before the last increment


@pytest.mark.slow
def test_poor_factors_are_renewed(built):
    model = edge()
    stepper = built(model, ALPHA, EDGE_PARAMETERS)
    stepper.initialize(np.array([2.0]), model.v, step=0.05)  # step^2 K varies between 1 and -0.4, b M is 4
    state = stepper.run(200).state
    assert 20 < state["factorizations"] < 2 * 200
    assert state["newton_iterations"] < 10 * 200
    assert state["halvings"] == 0


@pytest.mark.slow
@METHODS
def test_quaternions_keep_their_length_and_are_not_flipped(built, method):
    model = free_motion(["SO3", "SE3", "R", "R", "R3xSO3", "R"])
    stepper = built(model, method)
    v = np.concatenate([[0, 0, 30.0], [5, 20.0, -3, 1, 2, 3], [1.0, 2.0], [0, 7.0, 0, 3, 2, 1], [4.0]])
    stepper.initialize(model.q, v, step=0.01)
    rows = stepper.run(1000).rows
    for start in (0, 4, 13):
        p = rows[:, 1 + start : 5 + start]
        assert np.abs(np.linalg.norm(p, axis=1) - 1.0).max() < 1e-14
        assert np.sum(p[1:] * p[:-1], axis=1).min() > 0.9  # neighbours are never on opposite sides
    assert rows[:, 1].min() < -0.99


@pytest.mark.slow_except("rkmk")
@METHODS
def test_steady_motion_is_followed_exactly_on_every_group(built, method, rng):
    model = free_motion(["SO3", "SE3", "R", "R", "R3xSO3", "R"])
    stepper = built(model, method)
    v = rng.normal(size=len(model.v))
    q = product.update(model.equations.factors, model.q, rng.normal(size=len(v)))
    stepper.initialize(q, v, step=0.05)
    end = stepper.run(20).rows[-1]
    back = product.difference(
        model.equations.factors, product.update(model.equations.factors, q, v), end[1 : 1 + len(q)]
    )
    assert back == pytest.approx(0.0, abs=3e-14)


WRAPPERS = """
void test_update(const real *q, const real *x, real *out);
void test_update(const real *q, const real *x, real *out) { free_update_se3(q, x, out); }
void test_tangent(const real *x, real *out);
void test_tangent(const real *x, real *out) { free_tangent_se3(x, out); }
"""


@pytest.mark.slow
def test_group_functions_in_c_are_those_of_numpy(tmp_path, rng):
    library = build(tmp_path, free_motion(["SE3"]), ALPHA, extra=WRAPPERS).library
    for angle in (0.0, 1e-9, 1e-3, 0.4, 0.999, 1.001, 3.141, 3.142, 4.5):
        theta, q = rng.normal(size=6), numeric.exp(SE3, rng.normal(size=6))
        theta[:3] *= angle / np.linalg.norm(theta[:3])
        T, blocks, moved = numeric.tangent(SE3, theta), np.zeros((6, 3)), np.zeros(7)
        arrays = {"x": theta, "q": q, "T": blocks, "out": moved}
        pointers = {name: array.ctypes.data_as(ctypes.c_void_p) for name, array in arrays.items()}
        library.test_tangent(pointers["x"], pointers["T"])
        library.test_update(pointers["q"], pointers["x"], pointers["out"])
        assert blocks == pytest.approx(T[:, :3], abs=1e-15)
        assert moved == pytest.approx(numeric.update(SE3, q, theta), abs=2e-15)


SOLVER = (PROGRAMS / "inverse.c").read_text(encoding="utf-8")


@pytest.mark.slow
def test_iteration_matrix_in_c_is_the_derivative_of_the_step(tmp_path, rng):
    model, step = tied_body(), 0.3
    library = build(tmp_path, model, ALPHA, TIED, extra=SOLVER).library
    D, inverse = rng.normal(size=7), np.eye(7)
    g, b = float(ALPHA.gamma / ALPHA.beta), float((1 - ALPHA.alpha_m) / (ALPHA.beta * (1 - ALPHA.alpha_f)))

    def scaled_residual(change):
        # of the step as a function of its unknown, about an arbitrary v and vdot
        q = product.update(model.equations.factors, model.q, step * (D + change))
        return step * model.equations.residual(0.0, q, model.v + g * change, b / step * change)

    columns = [(scaled_residual(1e-5 * e) - scaled_residual(-1e-5 * e)) / 2e-5 for e in np.eye(7)]
    q = product.update(model.equations.factors, model.q, step * D)
    pointers = [np.ascontiguousarray(x).ctypes.data_as(ctypes.c_void_p) for x in (q, model.v, D)]
    library.test_inverse(*pointers, ctypes.c_double(step), inverse.ctypes.data_as(ctypes.c_void_p))
    assert inverse @ np.array(columns) == pytest.approx(np.eye(7), abs=1e-8)  # both transposed
