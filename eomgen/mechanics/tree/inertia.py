"""Shape integrals of a rigid body, and the wrench of its inertia forces in an affine field of accelerations
(``laws/rigid_bodies``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.products import import_target
from eomgen.formula.nodes import Formula
from eomgen.mechanics.laws.derived import LAWS
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    matrix_plus,
    multiply,
    outer,
    plus,
    scaled,
    skew,
    transpose,
)


@dataclass(frozen=True)
class AddedMass:
    """Mass that a force element adds at one place of a body, such as water that moves with the body: an acceleration a
    of the place requires the force M a.

    Attributes
    ----------
    position : (3,) m
    matrix : (3, 3) M, symmetric, kg
    """

    position: Vector
    matrix: Matrix


@dataclass(frozen=True)
class RecordedInertia:
    """Shape integrals of a rigid body about the origin of the body frame, in body axes.

    Attributes
    ----------
    mass : int dm, kg
    first : (3,) int s dm, kg m
    second : (3, 3) int s s^T dm, kg m^2; the usual inertia tensor is tr(second) I - second
    added : masses that force elements add at places of the body
    """

    mass: Scalar
    first: Vector
    second: Matrix
    added: tuple[AddedMass, ...] = ()

    def __add__(self, other: RecordedInertia) -> RecordedInertia:
        second = matrix_plus(self.second, other.second)
        return RecordedInertia(self.mass + other.mass, plus(self.first, other.first), second, self.added + other.added)

    def transform(self, R: Matrix, p: Vector) -> RecordedInertia:
        """Return the integrals about another frame, in which this frame has orientation R, (3, 3), and origin p, m."""
        first = apply(R, self.first)
        added = tuple(
            AddedMass(apply(R, item.position), multiply(multiply(R, item.matrix), transpose(R))) for item in self.added
        )
        return RecordedInertia(self.mass, first, multiply(multiply(R, self.second), transpose(R)), added).shift(p)

    def shift(self, p: Vector) -> RecordedInertia:
        """Return the integrals about a parallel frame, in which the origin of this frame is at p, (3,), m."""
        first = plus(self.first, scaled(self.mass, p))
        d, e = self.first, first
        entry = {(i, j): self.second[i][j] + (p[i] * e[j] + p[j] * d[i]) for i in range(3) for j in range(i, 3)}
        rows = [tuple(entry[min(i, j), max(i, j)] for j in range(3)) for i in range(3)]
        added = tuple(AddedMass(plus(item.position, p), item.matrix) for item in self.added)
        return RecordedInertia(self.mass, first, (rows[0], rows[1], rows[2]), added)  # type: ignore[arg-type]  # three entries each


def elements_with_mass(scene: Scene) -> dict[str, list[ForceElement]]:
    """Return the force elements that add mass to bodies, by body."""
    result: dict[str, list[ForceElement]] = {}
    for element in scene.elements:
        if body := element.adds_mass_to:
            result.setdefault(body, []).append(element)
    return result


def added_masses(
    algebra: Algebra, elements: Iterable[ForceElement], number: Callable[[Formula], Scalar]
) -> tuple[AddedMass, ...]:
    """Return the masses that force elements add to a body, in the body frame, by the function that each class names.
    ``number`` gives the value of a formula of parameters on the tape."""
    result: list[AddedMass] = []
    for element in elements:
        added: Any = import_target(element.added_masses)
        result += added(algebra, element, number)
    return tuple(result)


def inertia_about_center(algebra: Algebra, mass: Scalar, center: Vector, tensor: tuple[Scalar, ...]) -> RecordedInertia:
    """Return the shape integrals of a rigid body from mass, centre of mass and inertia tensor.

    Parameters
    ----------
    algebra : of the scalars
    mass : kg
    center : (3,) centre of mass, m, in body axes
    tensor : inertia about the centre of mass, body axes, kg m^2: xx, yy, zz, xy, xz, yz, products as tensor entries
    """
    xx, yy, zz, xy, xz, yz = tensor
    half_trace = (xx + yy + zz) * 0.5
    central = algebra.matrix([[half_trace - xx, -xy, -xz], [-xy, half_trace - yy, -yz], [-xz, -yz, half_trace - zz]])
    first = scaled(mass, center)
    return RecordedInertia(mass, first, matrix_plus(central, outer(first, center)))


def body_inertia(algebra: Algebra, body: Body, number: Callable[[Formula], Scalar]) -> RecordedInertia:
    """Return the shape integrals of a body of a scene. ``number`` gives the value of a formula of parameters on the
    tape."""
    tensor, mass = tuple(number(entry) for entry in body.inertia), number(body.mass)
    return inertia_about_center(algebra, mass, algebra.vector([number(item) for item in body.center_of_mass]), tensor)


def wrench(
    algebra: Algebra, inertia: RecordedInertia, acceleration: Vector, alpha: Vector, symmetric: Matrix | None = None
) -> tuple[Vector, Vector]:
    """Return moment about the origin and force of the acceleration field ``acceleration + (alpha~ + symmetric) s``.

    All are in body axes; ``symmetric`` None is 0. Added mass takes part as a mass does, with weight in a field that has
    gravity: forces of water take that away. Across an axis with equal second moments the symmetric part of the gradient
    cancels, and alpha cancels for opposite second moments.
    """
    gradient = skew(alpha) if symmetric is None else matrix_plus(symmetric, skew(alpha))
    values = {"m": inertia.mass}
    for i in range(3):
        values[f"A{i}"], values[f"d{i}"] = acceleration[i], inertia.first[i]
        for j in range(3):
            values[f"U{i}{j}"] = gradient[i][j]
            values[f"S{i}{j}"] = inertia.second[i][j]
    results = LAWS["virtual_work_of_rigid_body"].instantiate(algebra, values)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        first, second = inertia.second[j][j], inertia.second[k][k]
        if first.constant is None or second.constant is None or abs(first.constant) != abs(second.constant):
            continue
        across = (algebra.zero, algebra.zero) if symmetric is None else (symmetric[k][j], symmetric[j][k])
        paired = (
            2.0 * alpha[i] + (across[0] - across[1]) if first.constant == second.constant else across[0] + across[1]
        )
        alone = {**values, f"S{k}{k}": algebra.zero, f"U{k}{j}": paired}
        results[i] = LAWS["virtual_work_of_rigid_body"].instantiate(algebra, alone)[i]
    moment, force = (results[0], results[1], results[2]), (results[3], results[4], results[5])
    for item in inertia.added:
        load = apply(item.matrix, plus(acceleration, apply(gradient, item.position)))
        moment, force = plus(moment, cross(item.position, load)), plus(force, load)
    return moment, force
