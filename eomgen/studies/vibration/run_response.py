"""An output of a run at one time as a response to the standard normal variables of the scene's random processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import NumericalError
from eomgen.reliability import Expansion

if TYPE_CHECKING:
    from eomgen.model import Model

#: Steps of z by which gradients are differenced: the third derivative of a response of order 1 leaves 2e-9 of it.
_APART = 1e-4
#: What Newton's iteration leaves of steps is divided by these.
_TIGHT = {"rtol": 1e-13, "atol": 1e-15}


@dataclass
class RunResponse:
    """One output at the end of runs.

    Attributes
    ----------
    variables : tunable parameters that are standard normal
    output : name of an output, or of a component of it, ``tip[0]``
    span : t_end and step, s
    options : of ``simulate``
    runs, adjoints, tangents : solutions of the equations of motion, and of their linear ones backwards and forwards
        in time
    failed : samples whose runs failed
    """

    model: Model
    variables: Sequence[str]
    output: str
    span: tuple[float, float]
    options: Mapping[str, Any]
    runs: int = field(default=0, init=False)
    adjoints: int = field(default=0, init=False)
    tangents: int = field(default=0, init=False)
    failed: int = field(default=0, init=False)

    @property
    def spent(self) -> tuple[int, int, int]:
        """Runs, adjoint runs and tangents until now."""
        return self.runs, self.adjoints, self.tangents

    def spend(self, more: tuple[int, int, int]) -> None:
        """Count what another response has cost."""
        runs, adjoints, tangents = more
        self.runs, self.adjoints, self.tangents = self.runs + runs, self.adjoints + adjoints, self.tangents + tangents

    @property
    def size(self) -> int:
        return len(self.variables)

    def values(self, points: Array) -> Array:
        """Return the output (m,) at points (m, n), not a number where a run failed."""
        return self.samples(points)[0]

    def samples(self, points: Array) -> tuple[Array, Array]:
        """Return the output at the end of runs (m,), and its largest value within each, at points (m, n)."""
        self.runs += len(points)
        table = dict(zip(self.variables, points.T, strict=True))
        found = self.model.simulate_many(
            *self.span, table=table, columns=[f"output.{self.output}"], points=2, **self.options
        )
        self.failed += len(found.failed)
        final, highest = (found.results[f"output.{self.output}.{which}"] for which in ("final", "max"))
        return np.asarray(final, dtype=float), np.asarray(highest, dtype=float)

    def expansion(self, point: Array) -> Expansion:
        """Return the output with its gradient (n,) and Hessian (n, n)."""
        value, gradient = self.gradient(point)
        hessian = self.products(point, np.eye(self.size))
        return Expansion(value, gradient, 0.5 * (hessian + hessian.T))

    def products(self, point: Array, directions: Array) -> Array:
        """Return the Hessian at a point times directions (n, r), (n, r): differences of exact gradients."""
        found = np.empty_like(directions)
        for k, ahead in enumerate(_APART * directions.T):
            found[:, k] = (self.gradient(point + ahead)[1] - self.gradient(point - ahead)[1]) / (2.0 * _APART)
        return found

    def gradient(self, point: Array) -> tuple[float, Array]:
        """Return the output, and its derivatives (n,) by one adjoint run."""
        self.runs, self.adjoints = self.runs + 1, self.adjoints + 1
        found = self._sensitivities(point)
        gradient = found.gradients([f"final({self.output})"])[0]
        return float(self._column(found.outputs)[-1]), gradient

    def along(self, point: Array) -> tuple[Array, Array, Array]:
        """Return times (rows,), the output (rows,) and its derivatives (rows, n), by tangents along one run."""
        self.runs, self.tangents = self.runs + 1, self.tangents + self.size
        found = self._sensitivities(point)
        return found.t, self._column(found.outputs), self._column(found.derivatives)

    def ending(self, time: float) -> RunResponse:
        """Return the response at another end, which counts for itself."""
        return replace(self, span=(time, self.span[1]))

    def _sensitivities(self, point: Array) -> Any:
        given = dict(self.options)
        parameters = {**(given.pop("parameters", None) or {}), **dict(zip(self.variables, point.tolist(), strict=True))}
        settings = {**_TIGHT, **(given.pop("settings", None) or {})}
        name = self.output.partition("[")[0]
        try:
            found = self.model.sensitivities(
                *self.span, by=list(self.variables), of=[name], parameters=parameters, settings=settings, **given
            )
        except NumericalError as error:
            far = float(np.linalg.norm(point))
            what = f"the run {far:.3g} standard deviations from the mean fails: {error.problems[0].what}"
            raise NumericalError(what, "smaller steps, or thresholds nearer to the mean") from error
        return found

    def _column(self, tables: Mapping[str, Array]) -> Array:
        name, _, rest = self.output.partition("[")
        return tables[name][:, int(rest.rstrip("]"))] if rest else tables[name]
