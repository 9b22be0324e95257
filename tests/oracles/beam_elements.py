"""Stiffness of a beam element by the energy of wrenches that are in equilibrium along it, by quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import expm

from tests.oracles.evaluation import Array


def element_by_flexibility(
    section: Array, damping: Array, length: float, curvature: Array | None = None
) -> tuple[Array, Array]:
    """Return stiffness and damping of an element, (6, 6) each, from those of its sections, by the strain log(H)/l."""
    return element_by_varying_flexibility(lambda _: section, lambda _: damping, length, curvature)


def element_by_varying_flexibility(
    section: Callable[[float], Array], damping: Callable[[float], Array], length: float, curvature: Array | None = None
) -> tuple[Array, Array]:
    """Return stiffness and damping of an element whose sections vary with the distance from its middle.

    A strain that varies along a helix at rest moves its second end, seen from its middle, by the integral of
    Ad(exp(s ad)) strain; if it does not vary that is l B times the strain.
    """
    ad = _adjoint(np.array([*(np.zeros(3) if curvature is None else curvature), 1.0, 0.0, 0.0]))
    points, weights = np.polynomial.legendre.leggauss(24)
    flexibility, dissipation, mean = (np.zeros((6, 6)) for _ in range(3))
    for s, weight in zip(0.5 * length * points, 0.5 * weights, strict=True):
        Ad = expm(s * ad)
        strains = np.linalg.solve(section(s), Ad.T)
        flexibility += weight * Ad @ strains
        dissipation += weight * strains.T @ damping(s) @ strains
        mean += weight * Ad
    back = np.linalg.inv(mean)
    stiffness = np.linalg.inv(back @ flexibility @ back.T)
    return stiffness, stiffness @ back @ dissipation @ back.T @ stiffness


def element_to_second_order(section: Array, damping: Array, length: float, at_rest: Array) -> tuple[Array, Array]:
    """Return stiffness and damping of an element up to the square of its length, (6, 6) each, by its strain at rest,
    (6,)."""
    ad, flexibility, share = _adjoint(at_rest), np.linalg.inv(section), length**2 / 12.0
    dissipation = flexibility @ damping @ flexibility
    stiffness: Array = np.linalg.inv(flexibility + share * ad @ flexibility @ ad.T)
    return stiffness, stiffness @ (dissipation + share * ad @ dissipation @ ad.T) @ stiffness


def _adjoint(twist: Array) -> Array:
    turned, shifted = (np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) for x, y, z in (twist[:3], twist[3:]))
    return np.block([[turned, np.zeros((3, 3))], [shifted, turned]])
