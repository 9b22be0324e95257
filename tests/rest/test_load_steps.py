"""Rest of geometrically exact beams by load steps: any slenderness, large loads, past buckling, any number of
elements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import eomgen
from eomgen.compiled.functions import Functions
from eomgen.compiled.rest import equilibrium
from eomgen.compiled.rest.loaded_statics import ElementStrains
from eomgen.compiled.rest.sparse_partials import sparse_partials
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.errors import NumericalError
from eomgen.lie.product import update
from eomgen.pipeline.model import Model
from eomgen.solvers.bordered_newton import whole
from eomgen.solvers.statics import examine
from eomgen.system.sparsity import packed_places, unpacked_places
from tests.mechanics.test_cosserat_beams import elastica
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.oracles.evaluation import Array

pytestmark = pytest.mark.slow

EI = 500.0
LENGTH = 10.0


def loaded_beam(elements: int, **more: Any) -> Model:
    """Return a clamped beam with a force and a moment at its end, whose stretch and shear may be stiff."""
    stiff = ROLL_UP | dict.fromkeys(("stretch", "shear_y", "shear_z"), "1e4 * factor")
    scene = beam_scene(
        elements, {"force": ["push", "load", 0.0], "torque": [0.0, "torque", 0.0]}, {"stiffness": stiff, **more}
    )
    numbers = {"load": 0.0, "push": 0.0, "torque": 0.0, "factor": 1.0}
    scene["parameters"] = {name: {"value": value, "tunable": True} for name, value in numbers.items()}
    return eomgen.build(scene, profile="quick")


@pytest.fixture(scope="module")
def beam() -> Model:
    return loaded_beam(8)


def tip(model: Model, parameters: Mapping[str, float]) -> Array:
    rest = model.equilibrium(parameters=parameters)
    pose: Array = model.evaluate("poses", rest.q, parameters=parameters)["pose"][model.bodies.index("rope.8"), 4:]
    return pose


@pytest.mark.parametrize("factor", [1e-2, 1e10])  # slenderness L sqrt(EA/EI) from 4.5 to 4.5e6
def test_a_moment_rolls_beams_up_whatever_their_slenderness(beam: Model, factor: float) -> None:
    parameters = {"torque": 2.0 * np.pi * EI / LENGTH, "factor": factor}
    rest = beam.equilibrium(parameters=parameters, any_kind=True)
    pose = beam.evaluate("poses", rest.q, parameters=parameters)["pose"][beam.bodies.index("rope.8")]
    assert np.linalg.norm(pose[4:]) < 1e-9 * LENGTH
    np.testing.assert_allclose(pose[:4], [-1.0, 0.0, 0.0, 0.0], atol=1e-9)  # one full turn


def test_loads_far_beyond_the_bending_stiffness_are_carried(beam: Model) -> None:
    rest = beam.equilibrium(parameters={"load": 1000.0, "factor": 100.0})
    assert rest.stable
    assert not rest.undetermined
    residual = beam.evaluate("residual", rest.q, rest.v, rest.a, parameters={"load": 1000.0, "factor": 100.0})["r"]
    assert np.max(np.abs(residual)) < 1e-9 * 1000.0


def test_a_column_beyond_its_critical_load_is_found_buckled(beam: Model) -> None:
    """Euler's elastica: K(k) = L sqrt(P/EI), the tip at L (2 E/K - 1) along and 2 k L/K across."""
    load = 1.5 * np.pi**2 * EI / (4.0 * LENGTH**2)
    turned = LENGTH * np.sqrt(load / EI)
    k = brentq(lambda k: ellipk(k**2) - turned, 1e-3, 1.0 - 1e-12)
    along, across = LENGTH * (2.0 * ellipe(k**2) / ellipk(k**2) - 1.0), 2.0 * k * LENGTH / ellipk(k**2)
    parameters = {"push": -load, "factor": 1e4}
    found = tip(beam, parameters)
    assert found[0] == pytest.approx(along, abs=0.01 * LENGTH)
    assert np.hypot(found[1], found[2]) == pytest.approx(across, abs=0.01 * LENGTH)
    straight = beam.equilibrium(parameters=parameters, any_kind=True)
    assert straight.stable is False


def test_an_element_that_would_turn_by_half_a_turn_ends_load_steps_with_its_name(beam: Model) -> None:
    with pytest.raises(NumericalError, match=r"load steps from the start end at \S+ % of the loads, for the element"):
        beam.equilibrium(parameters={"torque": 9.0 * np.pi * EI / LENGTH})


def test_section_forces_have_the_geometric_part_of_the_tangent(beam: Model, rng: np.random.Generator) -> None:
    parameters = beam.parameter_array({"factor": 3.0})
    given: dict[str, Any] = {"t": 0.0, "parameters": parameters, "base": None}
    strains = ElementStrains(beam, parameters, given)
    q = update(beam.factors, beam.initial_q, 0.2 * rng.normal(size=beam.nv))
    d = strains.values(q)
    derivative = strains.derivative(q, d)
    at_rest = strains.values(beam.initial_q)
    forces = np.einsum("eij,ej->ei", strains.stiffness, d - at_rest)
    still, nothing = np.zeros(beam.nv), np.zeros(0)
    np.testing.assert_allclose(
        derivative.T @ forces.ravel(), beam.evaluate("residual", q, still, still, **given)["r"], atol=1e-9 * 1e4
    )
    stiffness = derivative.T @ np.kron(np.eye(8), strains.stiffness[0]) @ derivative
    tangent = stiffness + whole(strains.geometric(q, d, derivative, forces))
    expected = whole(sparse_partials(beam, q, still, still, nothing, nothing, given).K)
    np.testing.assert_allclose(tangent, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("closed", [False, True])
def test_small_scenes_rest_by_whole_matrices_as_large_ones_by_sparse_ones(
    closed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A support at the end adds constraint rows."""
    scene = beam_scene(3, {"force": [0.0, 0.0, "load"], "axes": "body"}, {"stiffness": ROLL_UP})
    if closed:
        end = [10.0, 0, 0]
        scene["points"] = {"end": {"body": "rope", "position": end}, "pin": {"body": "base", "position": end}}
        scene["constraints"] = {"pin": {"type": "spherical", "first": "pin", "second": "end"}}
        scene["forces"]["tip"]["point"] = [10.0 / 3.0, 0.0, 0.0]
    model = eomgen.build(scene, profile="quick")
    by_whole = model.equilibrium(parameters={"load": 30.0})
    monkeypatch.setattr("eomgen.compiled.rest.loaded_statics.WHOLE", 0)
    by_sparse = model.equilibrium(parameters={"load": 30.0})
    assert np.max(np.abs(by_whole.q - model.initial_q)) > 0.1
    np.testing.assert_allclose(by_whole.q, by_sparse.q, atol=1e-9)
    np.testing.assert_allclose(by_whole.multipliers, by_sparse.multipliers, atol=1e-7)


def test_a_point_of_a_search_evaluates_the_partials_once_for_all_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    model = eomgen.build(
        beam_scene(12, {"force": [0.0, 0.0, "load"], "axes": "body"}, {"stiffness": ROLL_UP}), profile="quick"
    )
    measures = SceneMeasures(model, model.parameter_array({}), 0.0, None)
    statics = equilibrium._statics(model, measures, model.initial_q, None, np.zeros(model.nv))
    calls: list[str] = []
    evaluated = Functions.__call__

    def counted(functions: Functions, name: str, blocks: Mapping[str, Array]) -> tuple[Array, ...]:
        calls.append(name)
        return evaluated(functions, name, blocks)

    monkeypatch.setattr(Functions, "__call__", counted)
    point = examine(statics, model.initial_q, np.zeros(0))
    assert calls == ["iteration", "residual"]
    state = model.initial_q, np.zeros(model.nv), np.zeros(model.nv), np.zeros(0), point.lam
    given = {"t": 0.0, "parameters": measures.p, "base": None}
    partials = sparse_partials(model, *state, given)
    basis = whole(point.basis)
    assert np.array_equal(whole(point.dual), basis.T @ whole(partials.M))
    assert np.array_equal(point.stiffness, basis.T @ whole(partials.K) @ basis)


def test_places_of_nonzeros_survive_as_text(rng: np.random.Generator) -> None:
    pairs = [(int(row), int(column)) for row, column in rng.integers(0, 10_000, size=(500, 2))]
    np.testing.assert_array_equal(unpacked_places(packed_places(pairs)).T, pairs)
    assert unpacked_places(packed_places([])).shape == (2, 0)
    banded = [(row, column) for row in range(20_000) for column in range(max(0, row - 2), row + 3)]
    assert len(packed_places(banded)) < 10_000


@pytest.mark.long
@pytest.mark.parametrize("model", ["kirchhoff", "inextensible"])
def test_beams_without_shear_and_stretch_bend_as_the_elastica(model: str) -> None:
    stiffness = dict.fromkeys(("torsion", "bending_y", "bending_z"), EI)
    stiffness |= {"stretch": 1e14} if model == "kirchhoff" else {}
    scene = beam_scene(8, {"force": [0.0, "load", 0.0]}, {"model": model, "stiffness": stiffness})
    found = tip(eomgen.build(scene, profile="quick"), {"load": 15.0})
    np.testing.assert_allclose(found[:2], elastica(15.0, EI, 1e14, 1e14), atol=3e-3 * LENGTH)


def test_nodes_that_joints_carry_turn_with_them(rng: np.random.Generator) -> None:
    scene = beam_scene(3, {}, type="revolute", axis=[0.0, 0.6, 0.8], position=[0.5, 0.0, 0.2])
    derivatives = []
    for terms in (["poses", "residual", "twists"], ["poses", "residual"]):
        model = eomgen.build(scene, terms=terms, profile="quick")
        strains = ElementStrains(model, model.parameter_array(None), {"t": 0.0, "parameters": None, "base": None})
        q = update(model.factors, model.initial_q, np.full(model.nv, 0.1))
        d = strains.values(q)
        derivatives.append(whole(strains.derivative(q, d)))
        step = 1e-6 * rng.normal(size=model.nv)
        ends = [strains.values(update(model.factors, q, sign * step)) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(2.0 * derivatives[-1] @ step, (ends[0] - ends[1]).ravel(), atol=1e-13)
    np.testing.assert_allclose(*derivatives, atol=1e-8)


def test_linear_models_of_beams_are_about_their_rest() -> None:
    model = eomgen.build(beam_scene(4, {"force": [0.0, 0.0, "10 * load"]}), profile="quick")
    linear = model.linearize()
    rest = model.equilibrium()
    np.testing.assert_allclose(linear.reference.q, rest.q, atol=1e-9)
    np.testing.assert_allclose(np.sort(linear.undamped_frequencies), rest.frequencies, rtol=1e-6)
