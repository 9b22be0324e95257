"""Quantities of the place at which a load acts, ``velocity.here[0]``, in the axes in which the load is given."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import Resolver, record
from eomgen.mechanics.forces.rotation_vectors import rotation_vector
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, transpose


@dataclass(frozen=True)
class Local:
    """A frame at the place of a load, and its motion in the world.

    Attributes
    ----------
    axes : of the frame, by columns, in world axes
    position : m, in world axes
    angular_velocity, velocity : rad/s and m/s, inertial, in the axes of the frame
    own_axes : whether the load is given in the axes of the frame, not of the world
    elsewhere : function for all other symbols
    """

    algebra: Algebra
    axes: Matrix
    position: Vector
    angular_velocity: Vector
    velocity: Vector
    own_axes: bool
    elsewhere: Resolver

    @cached_property
    def _quantities(self) -> Mapping[str, Callable[[], Vector]]:
        back = transpose(self.axes)
        return {
            "position": lambda: apply(back, self.position) if self.own_axes else self.position,
            "velocity": lambda: self.velocity if self.own_axes else apply(self.axes, self.velocity),
            "angular_velocity": lambda: (
                self.angular_velocity if self.own_axes else apply(self.axes, self.angular_velocity)
            ),
            # a rotation leaves its own vector alone, so the components are the same in both axes
            "rotation": lambda: rotation_vector(self.algebra, self.axes),
        }

    def vector(self, formulas: tuple[Formula, Formula, Formula]) -> Vector:
        """Return three formulas of the load, in the axes of the frame."""
        x, y, z = (record(self.algebra, formula, self._resolved) for formula in formulas)
        return (x, y, z) if self.own_axes else apply(transpose(self.axes), (x, y, z))

    def _resolved(self, symbol: Symbol) -> Scalar:
        if symbol.kind == "local":
            return self._quantities[symbol.name]()[symbol.index]
        return self.elsewhere(symbol)
