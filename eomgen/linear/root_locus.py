"""Root locus: eigenvalues of a linear model over a parameter, each followed from value to value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError, Problem
from eomgen.linear.linearization import Linearization
from eomgen.linear.plots import plot_root_locus

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class RootLocus:
    """Eigenvalues over a parameter.

    Attributes
    ----------
    parameter : name
    values : (n,)
    eigenvalues : (n, ns) complex, 1/s; a column is one root, followed by least distance from value to value
    stability : (n,) ``stable``, ``marginal`` or ``unstable`` for each value
    """

    parameter: str
    values: Array
    eigenvalues: Complex
    stability: tuple[str, ...]

    def __repr__(self) -> str:
        first, last = f"{self.values[0]:.6g}", f"{self.values[-1]:.6g}"
        roots = f"{self.eigenvalues.shape[1]} roots at {len(self.values)} values of {self.parameter}"
        return f"<RootLocus: {roots}, {first} to {last}; {', '.join(dict.fromkeys(self.stability))}>"

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the upper half plane of roots, coloured by the parameter, and return matplotlib's axes, a list of one.

        Parameters
        ----------
        axes : matplotlib Axes
            A new figure of pyplot if none are given.

        Raises
        ------
        UsageError
            Something that is no axes, or more than one.
        """
        return plot_root_locus(self, axes)


def root_locus(
    parameter: str, values: Sequence[float], linearized: Callable[[float, Linearization | None], Linearization]
) -> RootLocus:
    """Return the roots over values of a parameter.

    Parameters
    ----------
    linearized : callable
        From a value, and the linear model at the value before it, to the linear model there.

    Raises
    ------
    EomgenError
        Errors of ``linearized``, with the value at which it failed.
    """
    rows: list[Complex] = []
    stability: list[str] = []
    before: Linearization | None = None
    for value in values:
        try:
            before = linearized(float(value), before)
            roots = np.linalg.eigvals(before.state_space().A).astype(complex)
            stability.append(before.modes().stability)
        except EomgenError as error:
            problems = [
                Problem(f"at {parameter} = {value:.6g}: {p.where}".rstrip(": "), p.what, p.hint) for p in error.problems
            ]
            raise type(error)(problems) from None
        rows.append(_followed(rows[-1], roots) if rows else roots[np.lexsort((roots.real, np.abs(roots)))])
    return RootLocus(parameter, np.array(values, dtype=float), np.array(rows), tuple(stability))


def _followed(last: Complex, roots: Complex) -> Complex:
    """Return roots in the order of those before them that are nearest, all distances together being least."""
    _, order = linear_sum_assignment(np.abs(last[:, np.newaxis] - roots))
    result: Complex = roots[order]
    return result
