"""Inputs as series: a sum of modes times independent standard normal variables, then a map."""

from __future__ import annotations

import math
from collections.abc import Callable

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Formula

#: Prefix of the number of a variable in the name of its parameter.
_VARIABLE = "z"


def variables_of(name: str, count: int) -> tuple[str, ...]:
    """Return the names of the tunable parameters of an entry: its standard normal variables."""
    return tuple(f"{name}_{_VARIABLE}{k}" for k in range(1, count + 1))


@dataclass(frozen=True)
class NormalSeries:
    """A stationary process by its Karhunen-Loeve expansion: X(t) = T(g(x(t))), g(x) = mean + sum w_i z_i
    m_i(x).

    Attributes
    ----------
    name : of its input
    kind : of its covariance, by its name in scenes
    mean : of g
    variables : names of the tunable parameters that the z_i are
    weights : w_i
    modes : m_i = sqrt(lambda_i) phi_i, phi_i orthonormal over the window, the largest lambda first
    eigenvalues : w_i^2 lambda_i
    total : the sum of all eigenvalues, also of those left out: variance of g times length of the window
    seed : of the values that its own variables have by default
    speed, lag : x(t) = speed t - lag, m/s and m; over time, with speed 0, x(t) = t - lag, s
    follows : the repeated process; empty if none
    correlation : correlation coefficients with other processes; it has some of their variables
    coherent_with : processes that it is coherent with over frequencies; it has the variables of one of them
    translation : T, a formula of the symbol of kind ``gaussian``, which is g; None if X is g
    covariance : R at lags of x, of g with all modes and weights of 1; None if the covariance of the modes depends
        on more than the lag: for coherent processes and repaired covariances
    """

    name: str
    kind: str
    mean: float
    variables: tuple[str, ...]
    weights: tuple[float, ...]
    modes: tuple[Curve, ...]
    eigenvalues: tuple[float, ...]
    total: float
    seed: int = 0
    speed: float = 0.0
    lag: float = 0.0
    follows: str = ""
    correlation: tuple[tuple[str, float], ...] = ()
    coherent_with: tuple[str, ...] = ()
    translation: Formula | None = None
    covariance: Callable[[Array], Array] | None = field(default=None, compare=False, repr=False)

    @property
    def own_variables(self) -> tuple[str, ...]:
        """Independent standard normal variables of this process; none if it follows or is correlated with another."""
        own = variables_of(self.name, len(self.modes))
        return tuple(variable for variable in self.variables if variable in own)

    @property
    def window(self) -> tuple[float, float]:
        """Range of x with known values of the process, s or m."""
        return self.modes[0].start, self.modes[0].end

    @property
    def standard_deviation(self) -> float:
        """Of g, with all its modes, also those left out."""
        start, end = self.window
        return math.sqrt(self.total / (end - start))

    @property
    def captured(self) -> tuple[float, ...]:
        """Part of the variance of g in the first mode, in the first two, ..."""
        sums, value = [], 0.0
        for eigenvalue in self.eigenvalues:
            value += eigenvalue
            sums.append(value / self.total)
        return tuple(sums)
