"""Derivatives of runs of time-discontinuous Galerkin methods against complex steps of their passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.functions import LaneCompanions
from eomgen.products.derivatives import galerkin_sweeps, motion
from eomgen.products.derivatives.motion import ReplayedRun
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.scene.builder import SceneBuilder
from tests.derivatives.test_sensitivities import STEP, bending, built, controlled, refusal, tree, turning
from tests.models.cache import shared_cache
from tests.oracles.complex_galerkin import ComplexGalerkinRun
from tests.oracles.complex_runs import derivatives

__all__ = ["shared_cache"]

SWUNG = {"a": {"position": 0.7, "velocity": 0.2}, "b": {"position": -0.3, "velocity": 1.0}}
OF_TREE = ["mass", "stiffness", "damping", "length", "q.a", "v.b"]
TURNED = {"v": [1, 2, -1, 0.5, 2, 0.1, 0.3, 0.2, 0.1]}
OF_TURNS = ["mass", "length", "damping", "shake", "q.a[0]", "q.f[1]", "q.f[4]", "v.a[2]", "v.f[3]"]


def check(
    builder: SceneBuilder,
    method: str,
    by: Sequence[str],
    initial: Mapping[str, Any],
    steps: int = 6,
    tolerance: float = 1e-13,
    step: float = STEP,
) -> Sensitivities:
    """Hold derivatives of a run along directions to complex steps of it, and adjoints to tangents."""
    scene, model = built(builder)
    found = model.sensitivities(steps * step, step, by=by, method=method, initial=initial)
    run = model.simulate(steps * step, step, method=method, initial=initial, error_estimate=False)
    names = {"p": list(model.parameters), "q": [f"q{name[1:]}" for name in model.v_names]}
    names |= {"v": list(model.v_names), "z": list(model.z_names)}
    places = [(block, of.index(name)) for name in found.by for block, of in names.items() if name in of]
    start = {"q": run.q[0], "v": run.v[0], "z": run.z[0]}
    oracle = ComplexGalerkinRun(scene, method, step)
    values, expected = derivatives(oracle, steps, start, model.parameter_array(), places)
    for name, array in found.outputs.items():
        np.testing.assert_array_equal(array, run.outputs[name])
    columns = np.concatenate([array.reshape(steps + 1, -1) for array in found.outputs.values()], axis=1)
    assert np.max(np.abs(columns - values)) <= tolerance * np.max(np.abs(values))
    table = np.concatenate([np.atleast_3d(d).reshape(steps + 1, -1, len(by)) for d in found.derivatives.values()], 1)
    size = np.max(np.abs(expected), axis=(0, 1))
    assert np.all(size > 0.0)
    assert np.all(np.max(np.abs(table - expected), axis=(0, 1)) <= tolerance * size)
    components = [
        f"{name}[{k}]" if array.ndim > 1 else name
        for name, array in found.outputs.items()
        for k in range(array.shape[1] if array.ndim > 1 else 1)
    ]
    gradients = found.gradients([f"final({component})" for component in components])
    assert np.max(np.abs(gradients - table[-1])) <= tolerance * np.max(np.abs(table[-1]))
    return found


@pytest.mark.parametrize(
    "method", ["tdg1", "tdg2", *(pytest.param(name, marks=pytest.mark.slow) for name in ("tdg1_star", "tdg2s", "tdg3"))]
)
def test_a_tree_by_its_parameters_and_its_initial_state(method: str) -> None:
    check(tree(), method, OF_TREE, SWUNG)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tdg1", "tdg2"])
def test_bodies_that_turn_in_space_on_a_base_that_moves_by_a_parameter(method: str) -> None:
    check(turning(), method, OF_TURNS, TURNED)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tdg1", "tdg2"])
def test_a_controller_with_internal_states(method: str) -> None:
    check(controlled(), method, ["mass", "length", "lag", "gain", "q.a", "v.a", "z.filtered"], {"a": 0.6})


@pytest.mark.slow
def test_a_beam_at_steps_that_do_not_resolve_it() -> None:
    check(bending(), "tdg1", ["bend", "tip", "speed", "q.axle"], {"axle": {"velocity": 1.0}}, tolerance=1e-12)


def driven(formula: str | None) -> SceneBuilder:
    """Return a pendulum whose stiffness an input is, so that the matrix of a step depends on it."""
    builder = SceneBuilder(f"galerkin_driven_{'by_rows' if formula is None else 'by_formula'}")
    builder.parameter("mass", 1.3, tunable=True)
    builder.input("stiffness") if formula is None else builder.input("stiffness", formula=formula)
    builder.body("one", "mass", center_of_mass=[0.25, 0, -0.4], inertia=[0.1, 0.12, 0.05])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0], initial={"position": 0.4})
    return builder.effort("spring", "a", "-stiffness*q.a").output("y", formula="q.a*stiffness")


@pytest.mark.slow
def test_inputs_by_rows_are_those_of_the_formula_between_whose_values_they_are_linear() -> None:
    by_formula = built(driven("2 + 30*t"))[1].sensitivities(0.2, STEP, by=["mass", "q.a"], method="tdg2")
    rows = 2.0 + 30.0 * STEP * np.arange(21)
    by_rows = built(driven(None))[1].sensitivities(
        0.2, STEP, by=["mass", "q.a"], method="tdg2", inputs={"stiffness": rows}
    )
    np.testing.assert_allclose(by_rows.derivatives["y"], by_formula.derivatives["y"], rtol=1e-11, atol=1e-13)
    assert by_rows.gradient("integral(y)") == pytest.approx(by_formula.gradient("integral(y)"), rel=1e-12)


def test_functionals_and_long_runs_from_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    _, model = built(tree())
    options: dict[str, Any] = {"by": ["mass", "q.a"], "initial": {"a": 0.5}, "method": "tdg2"}
    kept = model.sensitivities(2.0, STEP, **options)
    monkeypatch.setattr(ReplayedRun.__init__, "__defaults__", (0,))
    monkeypatch.setattr(motion, "LONGEST", 64)
    again = model.sensitivities(2.0, STEP, **options)
    of = ["integral(angle)", "mean(two[1])", "sum(two[0])"]
    d = kept.derivatives
    expected = [
        np.trapezoid(d["angle"], kept.t, axis=0),
        np.trapezoid(d["two"][:, 1], kept.t, axis=0) / 2.0,
        d["two"][:, 0].sum(axis=0),
    ]
    np.testing.assert_allclose(kept.gradients(of), expected, rtol=1e-12)
    np.testing.assert_allclose(again.gradients(of), expected, rtol=1e-12)
    assert (len(kept._run.motion._checkpoints), len(again._run.motion._checkpoints)) == (0, 4)  # 200 steps, 64 in one


@pytest.mark.slow
def test_what_they_have_not_is_refused_by_name() -> None:
    _, model = built(tree())
    assert "tdg2_adaptive chooses its steps, and their ends move" in refusal(model, 0.05, STEP, method="tdg2_adaptive")


@pytest.mark.slow
def test_steps_whose_matrix_is_singular_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs fail at such steps themselves, so the factorization is told to end at the third one."""
    _, model = built(tree())
    made = galerkin_sweeps.routine

    def routine(*files: Any, **options: Any) -> tuple[Any, Any]:
        ffi, library = made(*files, **options)
        others = {name: getattr(library, name) for name in dir(library)}
        return ffi, SimpleNamespace(**others | {"eomgen_passes_begin": lambda *given: 2})

    found = model.sensitivities(5 * STEP, STEP, by=["mass"], method="tdg2")
    monkeypatch.setattr(galerkin_sweeps, "routine", routine)
    text = rf"the equations of the step from t = {2 * STEP:g} s, made linear, have no solution; try: a smaller step"
    with pytest.raises(eomgen.NumericalError, match=text):
        _ = found.derivatives


@pytest.mark.slow
def test_a_model_that_is_built_for_the_method_has_them_too() -> None:
    described = tree().build()
    own, other = (eomgen.build(described, method=method, profile="quick") for method in ("tdg1", "trapezoidal"))
    found, expected = (one.sensitivities(0.1, STEP, method="tdg1").gradient("final(angle)") for one in (own, other))
    np.testing.assert_allclose(list(found.values()), list(expected.values()), rtol=1e-12)


@pytest.mark.long
def test_sweeps_in_lanes_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a scene whose base moves by time: a gradient by pairs, tangents by rows."""
    by = ["length", "shake", "q.a[0]", "v.f[3]"]
    found = []
    for choice in ("off", "now"):
        monkeypatch.setenv("EOMGEN_LANES", choice)
        _, model = built(turning())
        one = model.sensitivities(20 * STEP, STEP, by=by, method="tdg1", initial=TURNED)
        found.append([one.gradients(["final(y[0])", "mean(y[1])"]), one.derivatives["y"]])
    companion = LaneCompanions.of(one._run.equations.second_functions.library)._found["second_partials"]
    assert companion.judged and not companion.refused
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)
