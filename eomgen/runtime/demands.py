"""Whether the properties of beams are what they must be at the parameters of a call: what is asked of fixed values in a scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import Problem, UsageError
from eomgen.scene.evaluate import evaluate, symbols
from eomgen.scene.formula_nodes import Formula
from eomgen.scene.names import key_of
from eomgen.scene.scene import Scene


@dataclass(frozen=True)
class Demand:
    """A property of a beam that is a formula of tunable parameters.

    Attributes
    ----------
    where : key of the scene
    what : how the property is called
    formula, names : the property, and the tunable parameters in it
    or_zero : whether it may be zero
    """

    where: str
    what: str
    formula: Formula
    names: tuple[str, ...]
    or_zero: bool

    def check(self, values: Mapping[str, float]) -> None:
        """Raise UsageError where the property is not what it must be at the values of all parameters."""
        said = ", ".join(f"{name} = {values[name]:.6g}" for name in self.names)
        try:
            number = evaluate(self.formula, lambda symbol: values[symbol.name])
        except ArithmeticError as error:
            raise UsageError(Problem(self.where, f"{self.what} has no value at {said}: {error}")) from None
        if number < 0.0 or (number == 0.0 and not self.or_zero):
            wanted = "0 or more" if self.or_zero else "above 0"
            raise UsageError(Problem(self.where, f"{self.what} is {number:.6g} at {said}", f"parameters at which it is {wanted}"))


def demands_of(scene: Scene) -> tuple[Demand, ...]:
    """Return what a scene demands of tunable parameters."""
    tunable = {item.name for item in scene.parameters if item.tunable}
    found = []
    for where, what, formula, or_zero in _properties(scene):
        names = tuple(sorted(tunable & {symbol.name for symbol in symbols(formula) if symbol.kind == "parameter"}))
        if names:
            found.append(Demand(where, what, formula, names, or_zero))
    return tuple(found)


def check_demands(demands: Sequence[Demand], scene: Scene, names: Sequence[str], parameters: NDArray[np.float64]) -> None:
    """Raise UsageError for the first set of tunable parameters (..., np) at which a beam is not one."""
    if not demands:
        return
    fixed = {item.name: item.value for item in scene.parameters}
    for row in parameters.reshape(-1, len(names)).tolist():
        values = fixed | dict(zip(names, row, strict=True))
        for demand in demands:
            demand.check(values)


def _properties(scene: Scene) -> Iterator[tuple[str, str, Formula, bool]]:
    """Yield key, name, formula, and whether zero will do, of all properties of beams that formulas may give."""
    for body in scene.bodies:
        if body.beam is None:
            continue
        key, of = key_of("beams", body.name), f"of beam {body.name}"
        yield key, f"the mass per length {of}", body.beam.mass_per_length, False
        yield key, f"the polar inertia {of}", body.beam.polar_inertia, True
        for item in body.beam.deformations:
            place = f"{key}.{item.kind}"
            yield place, f"the stiffness of {item.kind} {of}", item.stiffness, False
            yield place, f"the damping of {item.kind} {of}", item.stiffness_damping, True
            yield place, f"the inertia factor of {item.kind} {of}", item.inertia_factor, False
