"""Terms of the centre of mass and of the centroidal momentum."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics.centroidal import Centroidal
from eomgen.symbolic.scalar import Scalar
from eomgen.system.system import Block


def center_of_mass(derivation: Derivation) -> list[Block]:
    """Return the centre of mass in the world, (3,), m, and the mass, kg, of all that moves against the base."""
    of_all = Centroidal(derivation.kinematics)
    return [
        derivation.block("c", (3,), of_all.center(), "centre of mass in the world, m"),
        derivation.block("m", (1,), [of_all.mass], "mass, kg"),
    ]


def center_of_mass_jacobian(derivation: Derivation) -> list[Block]:
    """Return J, (3, nv): the velocity of the centre of mass against the base, in world axes, is J v."""
    return [_matrix(derivation, "J", 3, Centroidal(derivation.kinematics).jacobian(), "Jacobian of the centre of mass")]


def center_of_mass_jacobian_rate(derivation: Derivation) -> list[Block]:
    """Return dJ/dt, (3, nv)."""
    of_all = Centroidal(derivation.kinematics)
    return [_matrix(derivation, "J_dot", 3, of_all.rate(of_all.jacobian()), "dJ/dt of the centre of mass")]


def center_of_mass_drift(derivation: Derivation) -> list[Block]:
    """Return dJ/dt v, (3,)."""
    values = Centroidal(derivation.kinematics).center_drift()
    return [derivation.block("drift", (3,), values, "dJ/dt v of the centre of mass")]


def centroidal_momentum(derivation: Derivation) -> list[Block]:
    """Return A, (6, nv): the momentum about the centre of mass, in world axes, angular first, is A v."""
    return [_matrix(derivation, "A", 6, Centroidal(derivation.kinematics).momentum(), "centroidal momentum matrix")]


def centroidal_momentum_rate(derivation: Derivation) -> list[Block]:
    """Return dA/dt, (6, nv)."""
    of_all = Centroidal(derivation.kinematics)
    return [_matrix(derivation, "A_dot", 6, of_all.rate(of_all.momentum()), "dA/dt of the centroidal momentum matrix")]


def centroidal_drift(derivation: Derivation) -> list[Block]:
    """Return dA/dt v, (6,)."""
    values = Centroidal(derivation.kinematics).drift()
    return [derivation.block("drift", (6,), values, "dA/dt v of the centroidal momentum matrix")]


def _matrix(derivation: Derivation, name: str, rows: int, values: list[Scalar], description: str) -> Block:
    return derivation.block(name, (rows, derivation.tree.nv), values, description)


CENTROIDAL_RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "center_of_mass": center_of_mass,
    "center_of_mass_jacobian": center_of_mass_jacobian,
    "center_of_mass_jacobian_rate": center_of_mass_jacobian_rate,
    "center_of_mass_drift": center_of_mass_drift,
    "centroidal_momentum": centroidal_momentum,
    "centroidal_momentum_rate": centroidal_momentum_rate,
    "centroidal_drift": centroidal_drift,
}
