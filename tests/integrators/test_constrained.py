"""Constrained steppers: C against the NumPy oracle, and the numbers of the fast heavy top that codes and papers agree
on."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.generalized_alpha_cases import hht
from eomgen.integrators.stepper_layout import default_settings, row_layout
from tests.anchors import anchor
from tests.integrators.constrained_models import (
    FAST,
    chain,
    compile_scene,
    heavy_top,
    rolling_disc,
    shaking_base,
    top_errors,
    top_solution,
    two_links,
)
from tests.oracles.stepper import integrate
from tests.oracles.system_equations import equations_of

STABILISED, INDEX_3 = GeneralizedAlpha(0.9), GeneralizedAlpha(0.9, "index3")
PUBLISHED = {"rtol": 1e-8, "atol": 1e-10}


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    known = {}

    def get(name, scene, method=STABILISED):
        key = (name, method.form, method.variant, method.case)
        if key not in known:
            known[key] = compile_scene(tmp_path_factory.mktemp(name.replace(" ", "")), scene(), method)
        stepper = known[key]
        stepper.workspace[:] = 0.0
        stepper.settings = default_settings(stepper.program.method)
        return stepper

    return get


def top(compiled, group, method=STABILISED):
    return compiled(group, lambda: heavy_top(group), method)


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


# -- C against NumPy ---------------------------------------------------------------------------------------------------

SCENES = {
    "links": two_links,
    "links on a moving base": lambda: two_links(base=shaking_base()),
    "disc": rolling_disc,
    "chain": lambda: chain(3, "absolute"),
}
#: How these are solved: both ways are held against NumPy.
SOLVERS = {"disc": "unrolled", "chain": "tables"}


@pytest.mark.slow
@pytest.mark.long_except("disc-stabilised-F0", "disc-index3-F0", "links-stabilised-F0")
@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("links", STABILISED),
        ("links", GeneralizedAlpha(0.8, "index3", "F1")),
        ("links", GeneralizedAlpha(0.8, "stabilised", "F2")),
        ("links on a moving base", GeneralizedAlpha(0.8, "index3", "spatial")),
        ("links", GeneralizedAlpha(form="index3", case=hht(alpha=0.1))),
        ("links on a moving base", STABILISED),
        ("disc", STABILISED),
        ("disc", INDEX_3),
        ("chain", STABILISED),
    ],
    ids=lambda value: (
        value if isinstance(value, str) else f"{value.case.name if value.case else value.form}-{value.variant}"
    ),
)
def test_c_gives_what_numpy_gives(compiled, name, method):
    stepper = compiled(name, SCENES[name], method)
    assert stepper.program.method["solver"]["kind"] == SOLVERS.get(name, stepper.program.method["solver"]["kind"])
    equations = equations_of(stepper.system)
    q, v = np.array(stepper.system.initial_q), np.array(stepper.system.initial_v)
    v = v - np.linalg.pinv(equations.constraints.jacobian(0.0, q)) @ equations.constraints.rate(0.0, q, v)
    outcome = stepper.initialize(q, v, step=5e-3)
    assert (outcome.status, outcome.text) == (0, "ok")
    path = integrate(equations, method, q, v, 5e-3, 4)
    assert outcome.state["v"] == pytest.approx(path.v[0], abs=1e-11)
    rows = stepper.run(4).rows
    layout = row_layout(stepper.program.method)
    for key in ("t", "q", "v", "vdot", "lam"):
        expected = getattr(path, key)[1:].reshape(4, -1)
        scale = max(1.0, np.abs(expected).max())
        assert rows[:, layout[key]] == pytest.approx(
            expected, abs=1e-8 * scale if key in ("vdot", "lam") else 1e-10 * scale
        ), key


# -- initialisation ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("group", "linear"), [("R3xSO3", (0, -21.3017325444, -30.9608307692)), ("SE3", (0, 0, 661.346169230769))]
)
def test_consistent_start_of_the_heavy_top(compiled, group, linear):
    state = top(compiled, group).start(step=1e-3).state
    assert state["vdot"] == pytest.approx([661.346169230769, 0, 0, *linear], rel=1e-11, abs=1e-9)
    assert state["lam"] == pytest.approx([0.0, -319.525988166, -317.262461538], rel=1e-11, abs=1e-9)


@pytest.mark.slow
def test_a_state_off_the_constraints_is_brought_onto_them(compiled):
    stepper = top(compiled, "R3xSO3")
    q, v = np.array(stepper.system.initial_q), np.array(stepper.system.initial_v)
    q[4:] += [0.01, -0.02, 0.03]
    v[3:] += [1.0, 2.0, 3.0]
    assert stepper.initialize(q, v).status == 0
    state = stepper.run(5).state
    assert state["max_constraint"] < 1e-13
    assert state["max_constraint_velocity"] < 1e-11
    stepper.initialize(np.array(stepper.system.initial_q), np.array(stepper.system.initial_v))
    assert np.array_equal(stepper.state[stepper.layout["q"]], stepper.system.initial_q)
    assert np.array_equal(stepper.state[stepper.layout["v"]], stepper.system.initial_v)


# -- published errors, orders ------------------------------------------------------------------------------------------

#: Largest errors over t = j/16 of angle, position, Omega and lam at some steps 2^-k; index 3 with perturbed start.
#: Those of the stabilised form on R^3 x SO(3) depend on the metric in which eta moves positions: that of M's diagonal.
#: In the plain one, whose errors depend on the unit of length, they are 1.59e-3, 1.11e-3, 3.26e-3, 4.68e-1 in metres.
TABLE = {
    ("SE3", "stabilised"): {11: (3.21e-2, 1.97e-2, 3.00e-1, 21.4), 13: (2.01e-3, 1.23e-3, 1.87e-2, 1.34)},
    ("SE3", "index3"): {11: (3.21e-2, 1.97e-2, 3.00e-1, 21.4), 13: (2.01e-3, 1.23e-3, 1.87e-2, 1.34)},
    ("R3xSO3", "index3"): {11: (2.50e-3, 1.73e-3, 2.42e-2, 1.76), 13: (1.56e-4, 1.08e-4, 1.51e-3, 1.10e-1)},
    ("R3xSO3", "stabilised"): {11: (4.27e-4, 2.94e-4, 4.08e-3, 3.11e-1), 13: (2.67e-5, 1.84e-5, 2.55e-4, 1.95e-2)},
}


@pytest.mark.slow
@pytest.mark.parametrize(("group", "form"), TABLE)
def test_errors_and_orders_of_the_heavy_top(compiled, group, form):
    stepper, errors = top(compiled, group, GeneralizedAlpha(0.9, form)), {}
    for k in (11, 12, 13):
        stepper.start(step=2.0**-k, **PUBLISHED)
        outcome = stepper.run(2**k, every=2**k // 16)
        assert (outcome.status, len(outcome.rows)) == (0, 16)
        errors[k] = top_errors(outcome.rows)
    for k, published in TABLE[group, form].items():
        assert errors[k] == pytest.approx(published, rel=0.05)
    for column in range(4):
        assert slope(2.0 ** -np.array([*errors]), [error[column] for error in errors.values()]) == pytest.approx(
            2.0, abs=0.1
        )


#: Of the spatial variant, position errors in units of those of F0, at most.
SPATIAL = {("R3xSO3", "index3"): 0.02, ("SE3", "stabilised"): 0.08}


@pytest.mark.slow
@pytest.mark.parametrize(("group", "form"), SPATIAL)
def test_the_spatial_variant_is_of_second_order_with_small_constants(compiled, group, form):
    stepper, errors = top(compiled, group, GeneralizedAlpha(0.9, form, "spatial")), []
    for k in (11, 12, 13):
        stepper.start(step=2.0**-k, **PUBLISHED)
        outcome = stepper.run(2**k, every=2**k // 16)
        errors.append(top_errors(outcome.rows))
    for column in range(4):
        assert slope([4.0, 2.0, 1.0], [error[column] for error in errors]) == pytest.approx(2.0, abs=0.12)
    assert errors[-1][1] <= SPATIAL[group, form] * TABLE[group, form][13][1]
    assert errors[0][1] <= SPATIAL[group, form] * TABLE[group, form][11][1]


@pytest.mark.slow
def test_published_position_after_two_seconds(compiled):
    published, stepper, ends = anchor("heavy_top_places").reference[3:], top(compiled, "SE3"), []
    for step in (2e-5, 1e-5):
        stepper.start(step=step)
        ends.append(stepper.run(round(2.0 / step), every=round(2.0 / step)).rows[-1, 5:8])
    assert np.linalg.norm(ends[1] - published) < 5e-5
    assert np.linalg.norm((4.0 * ends[1] - ends[0]) / 3.0 - published) < 2e-6


# -- transients of multipliers -----------------------------------------------------------------------------------------


def multiplier_errors(stepper, steps, **settings):
    exact, errors = top_solution(FAST), []
    for step in steps:
        stepper.start(step=step, **PUBLISHED, **settings)
        rows = stepper.run(round(0.1 / step)).rows
        errors.append(max(np.linalg.norm(row[-3:] - exact(row[0])[3]) for row in rows))
    return errors


TRANSIENT_STEPS = (1e-3, 5e-4, 2.5e-4)


@pytest.mark.slow
def test_index_3_without_perturbed_start_loses_an_order(compiled):
    errors = multiplier_errors(top(compiled, "R3xSO3", INDEX_3), TRANSIENT_STEPS, perturb=0.0)
    assert errors == pytest.approx([123.0, 60.3, 29.9], rel=0.05)
    assert slope(TRANSIENT_STEPS, errors) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_perturbed_start_gives_index_3_its_order_back(compiled):
    errors = multiplier_errors(top(compiled, "R3xSO3", INDEX_3), TRANSIENT_STEPS)
    assert np.all(np.array(errors) <= 1.1 * np.array([2.13, 0.531, 0.133]))
    assert slope(TRANSIENT_STEPS, errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow_cases("SE3-published1")
@pytest.mark.slow_cases("R3xSO3-published0")
@pytest.mark.parametrize(("group", "published"), [("R3xSO3", (1.24, 0.309, 0.0773)), ("SE3", (8.34, 2.09, 0.523))])
def test_the_stabilised_form_has_no_transient(compiled, group, published):
    errors = multiplier_errors(top(compiled, group), TRANSIENT_STEPS)
    assert np.all(np.array(errors) <= 1.1 * np.array(published))
    assert slope(TRANSIENT_STEPS, errors) == pytest.approx(2.0, abs=0.1)


# -- constraints, damping, economy -------------------------------------------------------------------------------------


@pytest.mark.slow_cases("SE3-0.0", "R3xSO3-0.0")
@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 0.9, 1.0])
@pytest.mark.parametrize("group", ["R3xSO3", "SE3"])
def test_the_stabilised_form_takes_every_spectral_radius(compiled, group, rho):
    stepper = top(compiled, group)
    stepper.start(step=1e-3, rho_inf=rho)
    outcome = stepper.run(1000)
    assert outcome.status == 0
    assert outcome.state["max_constraint"] <= 1e-13
    assert outcome.state["max_constraint_velocity"] <= 1e-11
    largest = np.linalg.norm(outcome.rows[:, -3:], axis=1).max()
    assert largest == pytest.approx(876.0, rel=0.01 if rho >= 0.5 else 0.13)
    assert 0.0 < outcome.state["max_eta"] < 0.1 or group == "SE3"


@pytest.mark.slow
def test_index_3_refuses_spectral_radii_near_one(compiled):
    with pytest.raises(UsageError, match=r"does not bear a spectral radius of 0\.99, .* form stabilised"):
        GeneralizedAlpha(0.99, "index3")
    assert "damps multipliers too little" in GeneralizedAlpha(0.95, "index3").warnings(True)[0]
    assert INDEX_3.warnings(True) == GeneralizedAlpha(1.0).warnings(True) == ()
    stepper = top(compiled, "R3xSO3", INDEX_3)
    assert stepper.start(rho_inf=0.99).status == 4
    assert stepper.start(rho_inf=0.95).status == 0


@pytest.mark.slow
def test_a_group_of_rigid_motions_needs_one_factorization(compiled):
    counts = {}
    for group, method in (("SE3", STABILISED), ("SE3", INDEX_3), ("R3xSO3", INDEX_3)):
        stepper = top(compiled, group, method)
        stepper.start(step=1e-3, **PUBLISHED)
        state = stepper.run(1000).state
        counts[group, method.form] = state["factorizations"][0]
        if group == "SE3":
            assert state["factorizations"] <= 5
            assert state["newton_iterations"] <= 3200
    assert counts["R3xSO3", "index3"] >= 50 * counts["SE3", "index3"]


@pytest.mark.slow
def test_rolling_keeps_rows_at_velocity_level(compiled):
    for method in (STABILISED, INDEX_3):
        stepper = compiled("disc", rolling_disc, method)
        stepper.start(step=1e-3)
        state = stepper.run(500).state
        assert state["max_constraint"] < 1e-13
        assert state["max_constraint_velocity"] < (1e-11 if method is STABILISED else 1e-4)
