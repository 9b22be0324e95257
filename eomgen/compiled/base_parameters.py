"""Base parameters: the least number of combinations of inertial and friction parameters that decide inverse dynamics.

Dependences among the regressor's columns at random motions hold by structure: linear relations of
analytic functions that hold at enough random points hold everywhere (Gautier 1991; Khalil and Dombre 2002, section
9.4). Columns are kept from the root to the tips, so unidentifiable parts are counted with the body that carries them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array, count_of
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.terms import Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.solvers.redundancy import NoRankGap, independent_columns

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


@dataclass(frozen=True, repr=False)
class BaseParameters:
    """Combinations of the regressor's parameters pi that decide inverse dynamics, and no fewer do.

    tau = Y[:, columns] @ (matrix @ pi) + tau0, with Y and tau0 of ``regressor``.

    Attributes
    ----------
    parameters : names of the entries of pi
    columns : (n,) independent columns of Y; the parameter of each column leads its combination
    matrix : (n, parameters) coefficients of the combinations
    without_effect : parameters that inverse dynamics does not depend on
    values : (n,) at the values of the scene
    units : (n,) of the values
    """

    parameters: tuple[str, ...]
    columns: tuple[int, ...]
    matrix: Array
    without_effect: tuple[str, ...]
    values: Array
    units: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.columns)

    def __repr__(self) -> str:
        return f"<BaseParameters: {len(self)} of {len(self.parameters)} parameters>"

    def __str__(self) -> str:
        lines = [f"{len(self)} combinations of {len(self.parameters)} parameters"]
        listed = zip(self.expressions, self.values, self.units, strict=True)
        lines += [f"  {text} = {value:.6g} {unit}" for text, value, unit in listed]
        if self.without_effect:
            lines.append(f"without effect: {', '.join(self.without_effect)}")
        return "\n".join(lines)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameter that leads each combination."""
        return tuple(self.parameters[column] for column in self.columns)

    @property
    def expressions(self) -> tuple[str, ...]:
        """The combinations in words: ``upper.inertia_yy + 0.16 lower.mass``."""
        return tuple(_text(row, self.parameters, lead) for row, lead in zip(self.matrix, self.columns, strict=True))


def base_parameters(model: CompiledModel, parameters: Parameters = None, *, seed: int = 0) -> BaseParameters:
    """Return the base parameters: the smallest set of combinations of the regressor's parameters that determines
    inverse dynamics.

    The combinations are identified at random motions and checked at other motions. Dependent parameters are counted
    with the body nearer to the base. Coefficients are in SI units.

    Parameters
    ----------
    parameters : mapping or array
        As of ``simulate``; lengths decide the combinations.
    seed : int
        Of the random motions.

    Returns
    -------
    BaseParameters
        Independent columns of the regressor, coefficients of the combinations, values and units.

    Raises
    ------
    UsageError
        Constraints, absolute coordinates, bodies that deform.
    NumericalError
        Rounding hides whether some columns are independent.

    Examples
    --------
    >>> model = eomgen.build("examples/robot_arm/scene.toml")
    >>> len(model.base_parameters().columns)
    43
    """
    if model.multipliers:
        fault = "constraints share efforts out, so fewer combinations decide a motion than in the tree [E0036]"
        raise UsageError(Problem("base_parameters", fault, "the scene without its constraints"))
    p = model.evaluator.one_set(parameters, "base_parameters(...) for each set")
    pi = model.regressor_parameters(parameters=p)
    names = tuple(pi)
    rng = np.random.default_rng(count_of("seed", seed, 0))
    # four rows for each column
    motions = max(40, -(-4 * len(names) // model.nv))
    try:
        result = independent_columns(_rows(model, motions, rng, p))
    except NoRankGap as error:
        fault = f"the number of combinations is unknown: {error} [E0037]"
        hint = "masses, inertias and lengths of like sizes in other units, or another seed"
        raise NumericalError(Problem("base_parameters", fault, hint)) from None
    matrix = np.zeros((len(result.kept), len(names)))
    matrix[np.arange(len(result.kept)), result.kept] = 1.0
    matrix[:, result.others] = result.coefficients
    _check(_rows(model, motions, rng, p), result.kept, matrix)
    used = {*result.kept, *result.others}
    unused = tuple(name for column, name in enumerate(names) if column not in used)
    values = matrix @ np.array([float(value) for value in pi.values()])
    units = tuple(model.description.linear_parameters[column].unit for column in result.kept)
    return BaseParameters(names, result.kept, matrix, unused, values, units)


def _rows(model: CompiledModel, motions: int, rng: np.random.Generator, p: Array) -> Array:
    """Return the regressor at random motions, row below row."""
    q = model.random(motions, generator=rng, parameters=p)
    v, a = rng.normal(size=(2, motions, model.nv))
    t = rng.uniform(0.0, model.description.simulation.duration, motions)
    Y = model.regressor(q, v, a, t, parameters=p).matrix
    return np.asarray(Y.reshape(-1, Y.shape[-1]))


def _check(Y: Array, kept: tuple[int, ...], matrix: Array) -> None:
    """Raise NumericalError if combinations do not hold at other motions."""
    sizes = np.linalg.norm(Y, axis=0)
    missed = np.linalg.norm(Y - Y[:, kept] @ matrix, axis=0)
    if np.any(missed > COMPUTED * np.max(sizes, initial=0.0)):
        fault = "combinations that hold at some random motions do not hold at others [E0038]"
        raise NumericalError(Problem("base_parameters", fault, "another seed"))


def _text(row: Array, names: tuple[str, ...], lead: int) -> str:
    text = names[lead]
    for column in np.flatnonzero(row):
        if column != lead:
            factor = abs(float(row[column]))
            sign = "-" if row[column] < 0.0 else "+"
            text += f" {sign} {'' if factor == 1.0 else f'{factor:.10g} '}{names[column]}"
    return text
