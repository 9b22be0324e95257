"""Critical points by the stiffness alone: thin and thick rods, double roots, loads that follow, stable branches."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_bvp
from scipy.linalg import null_space
from scipy.optimize import brentq
from scipy.sparse import csc_array
from scipy.special import ellipe, ellipk

import eomgen
from eomgen.pipeline.model import Model
from eomgen.solvers.tangent_stiffness import TangentStiffness
from tests.anchors import anchor
from tests.models.cosserat import beam_scene
from tests.oracles.evaluation import Array

#: Part by which 8 elements miss Euler's load.
EIGHT = 3e-5


def rod(axes: str = "world") -> dict[str, Any]:
    """Return a clamped rod with EI = 1 and L = 1 that is pushed at its end; slenderness, masses and the second EI by
    parameters."""
    stiffness = dict.fromkeys(("stretch", "shear_y", "shear_z"), "stretch")
    stiffness |= {"torsion": "1.0", "bending_y": "second", "bending_z": "1.0"}
    beam = {"length": 1.0, "rotary_inertia": ["2*rotary", "rotary", "rotary"], "stiffness": stiffness}
    scene = beam_scene(8, {"force": ["-load", 0.0, 0.0], "axes": axes}, beam)
    numbers = {"load": 0.0, "stretch": 1e6, "second": 1.0, "rotary": 1e-5}
    scene["parameters"] = {name: {"value": value, "tunable": True} for name, value in numbers.items()}
    return scene


@pytest.fixture(scope="module")
def column() -> Model:
    return eomgen.build(rod(), profile="instant")


def euler(second: float, number: int = 1) -> float:
    return second * ((2 * number - 1) * np.pi / 2.0) ** 2


@pytest.mark.slow
@pytest.mark.parametrize("slenderness", [0.1, 0.01, 0.0005])
def test_round_rods_have_a_double_bifurcation_at_eulers_load(column: Model, slenderness: float) -> None:
    """With EA = GA shortening and shear cancel each other in Reissner's critical load."""
    stretch = 16.0 / slenderness**2
    given = {"stretch": stretch, "rotary": slenderness**2 / 16.0}
    path = column.equilibrium_path("load", 1.6 * euler(1.0), parameters=given)
    assert [(item.kind, item.multiplicity) for item in path.critical] == [("bifurcation", 2)]
    anchor("eulers_load").check(path.critical[0].value)
    np.testing.assert_array_equal(path.negative, np.where(path.values > path.critical[0].value, 2, 0))


@pytest.mark.slow
@pytest.mark.parametrize("rotary", [1e-5, 1e-7, 1e-9, 1e-12])
def test_masses_do_not_move_bifurcations(column: Model, rotary: float) -> None:
    path = column.equilibrium_path("load", 12.0, parameters={"rotary": rotary, "second": 4.0})
    assert [item.value for item in path.critical] == pytest.approx([euler(1.0), euler(4.0)], rel=EIGHT)
    assert [item.multiplicity for item in path.critical] == [1, 1]


@pytest.mark.slow
@pytest.mark.parametrize("rotary", [1e-5, 1e-9])
def test_becks_column_has_no_other_rest_at_any_load(rotary: float) -> None:
    """A force that follows the end (Beck 1952): it flutters at 20.05 EI / L^2, and has no static bifurcation."""
    path = eomgen.build(rod("body"), profile="instant").equilibrium_path("load", 60.0, parameters={"rotary": rotary})
    assert path.success
    assert not path.critical
    assert not path.negative.any()


@pytest.mark.slow
def test_a_branch_of_a_round_rod_is_one_of_a_family_and_stable(column: Model) -> None:
    """All planes of bending are alike, so one stiffness is zero but for rounding, and is no bifurcation."""
    path = column.equilibrium_path("load", 1.1 * euler(1.0))
    branch = path.branch(0, 1.5 * euler(1.0))
    assert branch.success
    assert not branch.critical
    assert not branch.negative.any()
    assert branch.column("rope.8.x")[-1] == pytest.approx(elastica(1.5 * euler(1.0))[0], abs=0.01)


def elastica(load: float) -> tuple[float, float]:
    """Return where the end of a clamped column is, along and across: K(k) = sqrt(P), Love 1927, section 263."""
    k = brentq(lambda k: ellipk(k**2) - np.sqrt(load), 1e-6, 1.0 - 1e-12)
    return 2.0 * ellipe(k**2) / ellipk(k**2) - 1.0, 2.0 * k / ellipk(k**2)


@pytest.mark.slow
@pytest.mark.parametrize(("stretch", "factor"), [(16e4, 1.2), (16e6, 1.5), (1e5, 2.0)])
def test_rest_past_buckling_does_not_depend_on_the_last_digit(column: Model, stretch: float, factor: float) -> None:
    load, ends = factor * euler(1.0), []
    for ulps in range(3):
        changed = {"load": load * (1.0 + 2.3e-16 * ulps), "stretch": stretch * (1.0 + 2.3e-16 * ulps)}
        rest = column.equilibrium(parameters=changed)
        assert rest.stable
        assert "past a bifurcation or limit point" in rest.message
        ends.append(column.evaluate("poses", rest.q, parameters=changed)["pose"][column.bodies.index("rope.8"), 4:])
    np.testing.assert_allclose(ends, [ends[0]] * 3, atol=1e-7)
    along, across = elastica(load)
    assert ends[0][0] == pytest.approx(along, abs=0.01)
    assert np.hypot(ends[0][1], ends[0][2]) == pytest.approx(across, abs=0.01)
    straight = column.equilibrium(parameters={"load": load, "stretch": stretch}, any_kind=True)
    assert straight.stable is False


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e-13])
def test_the_first_buckling_load_does_not_depend_on_the_unit_of_the_load(unit: float) -> None:
    scene = rod()
    scene["forces"]["tip"]["force"] = [f"-{unit} * load", 0.0, 0.0]
    loads = eomgen.build(scene, profile="instant").buckling_loads("load", count=1)
    assert loads.values[0] * unit == pytest.approx(euler(1.0), rel=EIGHT) and not loads.warning


def random_stiffness(seed: int, nv: int, rows: int, *, symmetric: bool = True, band: int = 0) -> TangentStiffness:
    """Return a stiffness with entries over ten powers of ten and constraints; with zeros beyond a band if given."""
    rng = np.random.default_rng(seed)
    K = rng.normal(size=(nv, nv))
    K = K + K.T if symmetric else K
    if band:
        K = np.where(np.abs(np.subtract.outer(np.arange(nv), np.arange(nv))) <= band, K, 0.0)
    sizes = 10.0 ** rng.uniform(-5.0, 0.0, nv)
    B = rng.normal(size=(rows, nv))
    return TangentStiffness(csc_array(K / np.outer(sizes, sizes)), csc_array(B / sizes), sizes)


def on_free(stiffness: TangentStiffness) -> Array:
    """Return the stiffness on what the constraints leave free, in the measure of the sizes."""
    free = null_space(stiffness.B.toarray() * stiffness.sizes) if stiffness.B.shape[0] else np.eye(len(stiffness.sizes))
    return np.asarray(free.T @ (stiffness.K.toarray() * np.outer(stiffness.sizes, stiffness.sizes)) @ free)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 30), st.integers(0, 2))
def test_signs_are_those_of_eigenvalues(seed: int, nv: int, rows: int) -> None:
    stiffness = random_stiffness(seed, nv, rows)
    expected = np.linalg.eigvalsh(on_free(stiffness))
    assert stiffness.negative == np.sum(expected < 0.0)
    nearest = expected[np.argsort(np.abs(expected))]
    found, directions = stiffness.next_to_zero(2)
    np.testing.assert_allclose(found[:2], nearest[: len(found[:2])], rtol=1e-6)
    np.testing.assert_allclose(
        (stiffness.B @ directions), 0.0, atol=1e-6 * np.abs(directions / stiffness.sizes[:, None]).max()
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 20), st.integers(0, 2))
def test_signs_without_a_potential_are_those_of_determinants(seed: int, nv: int, rows: int) -> None:
    stiffness = random_stiffness(seed, nv, rows, symmetric=False)
    assert not stiffness.symmetric
    assert stiffness.negative % 2 == int(np.linalg.det(on_free(stiffness)) < 0.0)


@pytest.mark.slow
def test_sparse_pivots_have_the_signs_of_eigenvalues() -> None:
    for seed in range(3):
        stiffness = random_stiffness(seed, 700, 5, band=6)
        assert stiffness.below(0.0) == np.sum(np.linalg.eigvalsh(on_free(stiffness)) < 0.0)


def rotor(gravity: list[float], elements: int = 4) -> Model:
    """Return a blade with little rotary inertia on a base that turns about z."""
    scene = rod()
    del scene["forces"]
    scene["beams"]["rope"]["elements"] = elements
    scene["gravity"] = gravity
    scene["parameters"] |= {"omega": {"value": 0.0, "tunable": True}}
    scene["base"] = {"rotation": [{"axis": [0, 0, 1], "angle": "omega * t"}]}
    return eomgen.build(scene, profile="instant")


@pytest.mark.slow
def test_a_base_that_is_held_for_want_of_a_steady_motion_is_said() -> None:
    blade = rotor([0.0, -0.3, 0.0], elements=1)
    with pytest.warns(RuntimeWarning, match=r"base held, which turns, for there is no steady motion: forces change"):
        found = blade.linearize(parameters={"omega": 4.0})
    assert found.reference.what == "equilibrium"


def elastica_across(load: float) -> Array:
    """Return where the end of an inextensible cantilever is, along and across, by collocation."""
    first = min(load, 3.0)
    s = np.linspace(0.0, 1.0, 201)
    y = np.array([first * (s - s**2 / 2.0), first * (1.0 - s), s, 0.3 * s])

    def ends(a: Array, b: Array) -> Array:
        return np.array([a[0], b[1], a[2], a[3]])

    for part in np.geomspace(first, load, 1 + int(2.0 * np.log2(load / first))):

        def slopes(_: Array, y: Array, part: float = part) -> Array:
            return np.array([y[1], -part * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

        solved = solve_bvp(slopes, ends, s, y, tol=1e-10, max_nodes=100_000)
        s, y = solved.x, solved.y
    return np.asarray(y[2:, -1])


def cantilever(elements: int) -> Model:
    """Return the rod with another number of elements, pushed across its end."""
    scene = rod()
    scene["beams"]["rope"]["elements"] = elements
    scene["forces"]["tip"]["force"] = [0.0, "load", 0.0]
    return eomgen.build(scene, profile="instant")


def off_elastica(model: Model, elements: int, given: dict[str, float]) -> tuple[float, str]:
    """Return by which part of the deflection the end is off, and the message of the rest."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rest = model.equilibrium(parameters=given)
    pose = model.evaluate("poses", rest.q, parameters=given)["pose"][model.bodies.index(f"rope.{elements}")]
    exact = elastica_across(given["load"])
    return float(np.linalg.norm(pose[4:6] - exact) / np.linalg.norm(exact - [1.0, 0.0])), rest.message


@pytest.mark.slow
@pytest.mark.parametrize(("load", "noted"), [(3.0, False), (30.0, False), (150.0, True)])
def test_rest_of_a_beam_with_too_few_elements_says_by_how_much_it_is_off(load: float, noted: bool) -> None:
    """Four elements, against the elastica."""
    error, message = off_elastica(cantilever(4), 4, {"stretch": 1e8, "load": load})
    too_few = "too few elements in the beam rope: element 1 bends by"
    said = re.search(rf"{too_few} \d+ % of its length within itself, displacements are off by some (\d+) %", message)
    assert (said is not None) == noted
    assert said is None or 1.0 / 3.0 < float(said[1]) / (100.0 * error) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("elements", "deflections", "frequencies"),
    [
        (4, [5e-6, 1.0e-4], [-2.8, -8.8, -13.8]),
        (8, [4e-7, 6.4e-6], [-0.71, -2.4, -3.9]),
        (16, [3e-7, 8e-7], [-0.18, -0.62, -1.0]),
        (32, [3e-7, 5e-7], [-0.045, -0.16, -0.26]),
    ],
)
def test_how_many_elements(elements: int, deflections: list[float], frequencies: list[float]) -> None:
    """The table of docs/statics.md."""
    model, slender = cantilever(elements), {"stretch": 1e7, "rotary": 1e-7}
    for load, expected in zip((0.1, 3.0), deflections, strict=True):
        assert off_elastica(model, elements, {**slender, "load": load})[0] == pytest.approx(expected, rel=0.15)
    found = model.linearize(parameters=slender).modes().angular_frequency[:6:2]
    assert 100.0 * (found / [3.51602, 22.0345, 61.6972] - 1.0) == pytest.approx(frequencies, rel=0.04)
