"""Polynomial and finite-element shape functions: fractions, known frequencies, orders of convergence, tapers, tip
masses."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.scene.bodies.model import DeformationKind, Ends
from tests.mechanics.test_shape_integrals import deformation, integrals

pytestmark = pytest.mark.slow


def frequencies(found: ShapeIntegrals, inertia: Any = None) -> Any:
    """Return squared frequencies of k and m, or of k and another inertia."""
    mass = found.m if inertia is None else inertia
    root = np.linalg.inv(np.linalg.cholesky(mass))
    return np.linalg.eigvalsh(root @ found.k @ root.T)


def test_polynomials_are_fractions_rounded_once() -> None:
    """s^2, s^2 (6 s - 5) and s^2 (28 s^2 - 42 s + 15), integrated by hand."""
    found = integrals(deformation("bending_y", 3, "polynomial"))
    assert np.diag(found.m).tolist() == [1 / 5, 1 / 7, 1 / 9]
    assert np.array_equal(found.m, np.diag(np.diag(found.m)))
    assert found.d.tolist() == [1 / 3, -1 / 6, 1 / 10]
    assert found.k[0].tolist() == [4.0, 16.0, 32.0]
    assert found.g0[0, 0] == 1 / 3  # int (1 - s) 4 s^2
    assert found.at(1.0).value.tolist() == [1.0, 1.0, 1.0]


KINDS: list[tuple[DeformationKind, Ends]] = [
    (kind, ends)
    for kind in ("bending_y", "stretch", "torsion")
    for ends in ("clamped_free", "free_free", "pinned_pinned")
]


@pytest.mark.parametrize(("kind", "ends"), KINDS)
@pytest.mark.parametrize("shapes", ["polynomial", "finite_elements"])
def test_frequencies_of_uniform_beams(kind: DeformationKind, ends: Ends, shapes: Any) -> None:
    more = {"elements": 40} if shapes == "finite_elements" else {}
    found = integrals(deformation(kind, 9, shapes, ends=ends, **more), start=-1.0, length=2.0, polar_inertia=1.0)
    squared = frequencies(found, found.t2 if kind == "torsion" else None)[:3]
    if kind.startswith("bending"):
        equation = {"clamped_free": -1, "free_free": 1}.get(ends)
        starts = {"clamped_free": (1.9, 4.7, 7.9), "free_free": (4.7, 7.9, 11.0)}.get(ends, ())
        waves = [float(mpmath.findroot(lambda x: mpmath.cos(x) * mpmath.cosh(x) - equation, start)) for start in starts]
        waves = waves or [np.pi, 2 * np.pi, 3 * np.pi]
        exact = (np.array(waves) / 2.0) ** 4
    else:
        exact = (np.pi * (np.arange(1, 4) - (0.5 if ends == "clamped_free" else 0.0)) / 2.0) ** 2
    np.testing.assert_allclose(squared, exact, rtol=5e-5 if shapes == "polynomial" else 1e-5)
    assert found.at(-1.0).value.any() == (ends == "free_free")
    assert found.at(1.0).value.any() == (ends != "pinned_pinned")


def test_modes_of_a_mesh_have_all_their_digits() -> None:
    """Nothing is left of eigenvectors in double precision: what vanishes by orthogonality or symmetry is zero."""
    shape = deformation("bending_y", 4, "finite_elements", elements=24, ends="pinned_pinned")
    found = integrals(shape, start=-1.0, length=2.0)
    for matrix in (found.m, found.k):
        assert np.array_equal(matrix, np.diag(np.diag(matrix)))
    assert not found.d[1::2].any() and not found.e[::2].any() and found.at(0.0).value[1] == 0.0


@pytest.mark.parametrize(("mass", "inertia"), [(0.5, 0.0), (2.0, 0.1)])
def test_modes_with_a_mass_at_the_tip(mass: float, inertia: float) -> None:
    """Frequencies of a cantilever with a tip body of a mass and an inertia, both by the beam's own (length 1)."""
    found = integrals(deformation("bending_z", 2, "finite_elements", elements=40, masses=((1.0, mass, inertia),)))

    def determinant(x: float) -> float:
        """Return the determinant of shear and moment at the tip for cosh - cos and sinh - sin."""
        C, c, S, s = np.cosh(x), np.cos(x), np.sinh(x), np.sin(x)
        moment = [x**2 * (C + c) - inertia * x**4 * x * (S + s), x**2 * (S + s) - inertia * x**4 * x * (C - c)]
        shear = [x**3 * (S - s) + mass * x**4 * (C - c), x**3 * (C + c) + mass * x**4 * (S - s)]
        return float((moment[0] * shear[1] - moment[1] * shear[0]) / C)

    samples = np.linspace(0.3, 6.0, 500)
    signs = np.array([determinant(x) for x in samples])
    crossings = np.flatnonzero(signs[:-1] * signs[1:] < 0.0)[:2]
    exact = [brentq(determinant, samples[place], samples[place + 1], xtol=1e-14) ** 4 for place in crossings]
    tip = found.at(1.0)
    whole = found.m + mass * np.outer(tip.value, tip.value) + inertia * np.outer(tip.slope, tip.slope)
    np.testing.assert_allclose(frequencies(found, whole), exact, rtol=1e-6)
    np.testing.assert_allclose(whole, np.diag(np.diag(whole)), atol=1e-9)


def test_nodal_coordinates_of_cubic_elements() -> None:
    """Deflection and slope at each node are the coordinates themselves, whatever the length."""
    found = integrals(deformation("bending_y", 4, "finite_elements", elements=2, nodal=True), length=5.0)
    for x, first in ((2.5, 0), (5.0, 2)):
        value, slope = np.zeros(4), np.zeros(4)
        value[first], slope[first + 1] = 1.0, 1.0
        np.testing.assert_allclose(found.at(x).value, value, atol=1e-15)
        np.testing.assert_allclose(found.at(x).slope, slope, atol=1e-15)
    h = 2.5  # the stiffness of a clamped element for its second node
    np.testing.assert_allclose(found.k[2:, 2:], np.array([[12.0, -6 * h], [-6 * h, 4 * h * h]]) / h**3, rtol=1e-13)


@pytest.mark.parametrize("shapes", ["free_free", "polynomial", "finite_elements"])
def test_free_shapes_have_mean_axes(shapes: Any) -> None:
    """They move neither the centre of mass nor, in bending, the axis of inertia: the floating frame is the mean of the
    motion."""
    more = {"elements": 30} if shapes == "finite_elements" else {}
    bending = deformation("bending_y", 4, shapes, ends="free_free", **more)
    stretch = deformation("stretch", 3, shapes, ends="free_free", **more)
    found = integrals(bending, stretch, start=-2.0, length=3.0)
    np.testing.assert_allclose(found.d, 0.0, atol=1e-8)
    np.testing.assert_allclose(found.e[:4], 0.0, atol=1e-8)
    if shapes == "polynomial":
        assert not found.d.any() and not found.e[:4].any()


@pytest.mark.parametrize(
    ("shapes", "ends"),
    [(shapes, ends) for shapes in ("clamped_free", "free_free", "pinned_pinned") for ends in ("clamped_free",)]
    + [
        (shapes, ends)
        for shapes in ("polynomial", "finite_elements")
        for ends in ("clamped_free", "free_free", "pinned_pinned")
    ],
)
def test_normalisations(shapes: Any, ends: Ends) -> None:
    more = {"elements": 12} if shapes == "finite_elements" else {}
    end = ends if shapes in ("polynomial", "finite_elements") else shapes
    for kind in ("bending_y", "stretch"):
        same = integrals(deformation(kind, 3, shapes, ends=ends, normalisation="mean_square", **more))
        np.testing.assert_allclose(np.diag(same.m), 1.0, rtol=1e-13)
        unit = integrals(deformation(kind, 3, shapes, ends=ends, normalisation="unit", **more))
        values = np.array([unit.at(x).value for x in np.linspace(0.0, 1.0, 61)])
        if end == "pinned_pinned":
            assert (np.abs(values).max(axis=0) > 0.99).all() and (np.abs(values) <= 1.0 + 1e-15).all()
            assert (values[1] > 0.0).all()
        else:
            np.testing.assert_allclose(values[-1], 1.0, rtol=1e-14)
        natural = integrals(deformation(kind, 3, shapes, ends=ends, **more))
        ratios = np.diag(natural.k) / np.diag(natural.m)
        np.testing.assert_allclose(np.diag(same.k) / np.diag(same.m), ratios, rtol=1e-12)
