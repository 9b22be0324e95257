"""Elements whose sections vary: static deflections by quadrature along the beam, masses by their integrals,
frequencies by fine Hermite elements and of the pointed wedge."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh

import eomgen
from eomgen.formula.evaluate import evaluate
from eomgen.mechanics.forces.cosserat_beams import with_varying_sections
from eomgen.scene.load import from_data
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from tests.oracles.beam_elements import element_by_varying_flexibility
from tests.oracles.evaluation import Array
from tests.scene.test_cosserat_beams import beam_of

#: Stiffness and mass by s, with knots that no node of 2, 5, 8 or 16 elements meets.
KNOTS = [0.0, 0.07, 0.31, 0.33, 0.59, 1.0]
BENDING, MASS = [9.0, 8.0, 5.0, 2.0, 1.6, 0.2], [4.0, 5.0, 2.5, 2.0, 1.5, 0.3]


def table(values: list[float]) -> dict[str, Any]:
    return {"interpolation": "linear", "points": [list(pair) for pair in zip(KNOTS, values, strict=True)]}


def bending(s: float | Array) -> Any:
    return np.interp(s, KNOTS, BENDING)


def scene(elements: int, model: str, **changes: Any) -> dict[str, Any]:
    rigid = {"stretch": 1e9, "shear_y": 1e9, "shear_z": 1e9, "torsion": "ei(s)"}
    without = {"kirchhoff": ("shear_y", "shear_z"), "inextensible": ("stretch", "shear_y", "shear_z")}.get(model, ())
    stiffness = {key: value for key, value in rigid.items() if key not in without}
    beam = {
        "model": model,
        "length": 1.0,
        "elements": elements,
        "mass_per_length": "m(s)",
        "rotary_inertia": ["2e-7 * m(s)", "1e-7 * m(s)", "1e-7 * m(s)"],
        "stiffness": stiffness | {"bending_y": "E * ei(s)", "bending_z": "ei(s)"},
    }
    return {
        "format": 1,
        "name": "tapered",
        "gravity": [0, 0, 0],
        "parameters": {"E": {"value": 1.0, "tunable": True}},
        "curves": {"ei": table(BENDING), "m": table(MASS)},
        "beams": {"b": beam | changes},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "b"}},
    }


def integral(function: Callable[[float], float]) -> float:
    return float(quad(function, 0.0, 1.0, points=KNOTS[1:-1], epsabs=0.0, epsrel=1e-13)[0])


@pytest.mark.slow
def test_nodes_have_the_mass_of_their_halves_and_its_place() -> None:
    nodes = beam_of(from_data(scene(5, "cosserat", center_of_mass=["0.1 * s", 0]))).bodies()
    masses = [evaluate(node.mass, lambda _: 1.0) for node in nodes]
    offsets = [evaluate(node.center_of_mass[1], lambda _: 1.0) for node in nodes]
    ends = np.clip(np.linspace(-0.1, 1.1, 7), 0.0, 1.0)
    for mass, offset, low, high in zip(masses, offsets, ends[:-1], ends[1:], strict=True):
        inside = [knot for knot in KNOTS if low < knot < high] or None
        own = quad(lambda s: np.interp(s, KNOTS, MASS), low, high, points=inside)[0]
        first = quad(lambda s: 0.1 * s * np.interp(s, KNOTS, MASS), low, high, points=inside)[0]
        assert mass == pytest.approx(own, rel=1e-12) and offset == pytest.approx(first / own, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("elements", "parameter"), [(1, 1.0), (5, 3.0)])
def test_loads_at_the_tip_deflect_by_the_integral_of_the_compliance(elements: int, parameter: float) -> None:
    """A small force P and moment T: w = int ((1 - s) P + T) (1 - s) / EI, turn = int ((1 - s) P + T) / EI."""
    force, moment = 1e-6, 3e-6
    given = scene(elements, "cosserat") | {
        "forces": {"tip": {"body": "b", "point": [1, 0, 0], "force": [0, force, 0], "torque": [0, 0, moment]}}
    }
    rest = eomgen.build(given, profile="quick").equilibrium(parameters={"E": parameter})
    compliant = integral(lambda s: ((1 - s) * force + moment) * (1 - s) / (parameter * bending(s)))
    assert rest.q[-2] == pytest.approx(compliant, rel=1e-6)


def hermite_frequencies(parts: int = 60) -> Array:
    """Return the angular frequencies of bending of Hermite elements between the knots, with consistent masses."""
    places = np.union1d(np.linspace(0.0, 1.0, parts + 1), KNOTS)
    points, weights = np.polynomial.legendre.leggauss(6)
    u = 0.5 + 0.5 * points
    stiffness, mass = np.zeros((2, 2 * len(places), 2 * len(places)))
    for k, (low, high) in enumerate(pairwise(places)):
        h = high - low
        shapes = np.array([1 - 3 * u**2 + 2 * u**3, h * u * (1 - u) ** 2, 3 * u**2 - 2 * u**3, h * u**2 * (u - 1)])
        bent = np.array([12 * u - 6, h * (6 * u - 4), 6 - 12 * u, h * (6 * u - 2)]) / h**2
        own, weight = slice(2 * k, 2 * k + 4), 0.5 * h * weights
        stiffness[own, own] += (bent * weight * bending(low + h * u)) @ bent.T
        mass[own, own] += (shapes * weight * np.interp(low + h * u, KNOTS, MASS)) @ shapes.T
    return np.sqrt(eigh(stiffness[2:, 2:], mass[2:, 2:], eigvals_only=True, subset_by_index=[0, 3]))


@pytest.mark.long
@pytest.mark.parametrize(("model", "within"), [("cosserat", 0.03), ("kirchhoff", 0.006)])
def test_frequencies_of_a_table_converge_with_the_square_of_the_elements(model: str, within: float) -> None:
    errors = []
    for elements in (4, 8):
        found = eomgen.build(scene(elements, model), profile="quick").linearize().modes().angular_frequency[:4:2]
        errors.append(np.abs(found / hermite_frequencies()[:2] - 1.0))
    assert np.max(errors[1]) < within  # four times the bounds 0.007 and 0.0015 with 16 elements
    assert errors[0][0] > 3.2 * errors[1][0]  # of the second mode two errors cancel in part


@pytest.mark.long
def test_a_wedge_that_ends_in_a_point_has_its_published_frequency() -> None:
    """Kirchhoff 1879: 5.315 of a wedge whose stiffness vanishes at the end, so that its compliance has no integral."""
    stiffness = {"torsion": 1.0, "bending_y": "(1 - s)**3", "bending_z": "(1 - s)**3", "stretch": 1e9}
    inertia = {"mass_per_length": "1 - s", "rotary_inertia": ["2e-7 * (1 - s)", "1e-7 * (1 - s)", "1e-7 * (1 - s)"]}
    model = eomgen.build(scene(8, "kirchhoff", stiffness=stiffness, **inertia), profile="quick")
    assert model.linearize().modes().angular_frequency[0] == pytest.approx(5.315, rel=4e-3)


def test_an_element_of_coupled_sections_has_the_flexibility_of_its_moments(rng: np.random.Generator) -> None:
    def definite() -> Array:
        root = rng.normal(size=(6, 6))
        matrix: Array = root @ root.T + 0.3 * np.eye(6)
        return matrix

    length, ends, dampers = 1.7, (definite(), definite()), (definite(), definite())

    def between(pair: tuple[Array, Array], s: float) -> Array:
        return np.asarray(pair[0] + (0.5 + s / length) * (pair[1] - pair[0]))

    points, weights = np.polynomial.legendre.leggauss(24)
    places = 0.5 * length * points
    compliance = [np.linalg.inv(between(ends, s)) for s in places]
    rates = [one @ between(dampers, s) @ one for one, s in zip(compliance, places, strict=True)]
    algebra = Algebra(Tape())

    def rows(matrix: Array) -> Any:
        return [[algebra.scalar(float(entry)) for entry in row] for row in matrix]

    means = [
        [rows(np.einsum("k,kij->ij", 0.5 * weights * places**power, np.array(each))) for power in range(3)]
        for each in (compliance, rates)
    ]
    found = with_varying_sections(algebra, rows(between(ends, 0.0)), means[0], means[1], [0, 0, 0, 1, 0, 0])
    stiffness, damping = (
        np.array([[entry.constant for entry in row] for row in matrix], float)
        for matrix in (found.stiffness, found.damping)
    )
    expected = element_by_varying_flexibility(lambda s: between(ends, s), lambda s: between(dampers, s), length)
    np.testing.assert_allclose(stiffness, expected[0], rtol=1e-8, atol=1e-8 * np.abs(expected[0]).max())
    np.testing.assert_allclose(damping, expected[1], rtol=1e-8, atol=1e-8 * np.abs(expected[1]).max())


@pytest.mark.slow
def test_a_curvature_by_a_table_turns_by_its_integral() -> None:
    beam = beam_of(from_data(scene(1, "cosserat", curvature=[0, 0, "0.1 * m(s)"])))
    assert beam.parts[0].twist[2] == pytest.approx(integral(lambda s: 0.1 * np.interp(s, KNOTS, MASS)), rel=1e-12)
