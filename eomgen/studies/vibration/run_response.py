"""An output of a run at one time as a response to the standard normal variables of the scene's random processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import NumericalError, UsageError
from eomgen.reliability import Expansion
from eomgen.simulation.sensitivities.functionals import component
from eomgen.simulation.sensitivities.linearise import newton_settings

if TYPE_CHECKING:
    from eomgen.model import Model
    from eomgen.simulation.sensitivities.run_sensitivities import Sensitivities

#: Steps of z by which gradients are differenced: the third derivative of a response of order 1 leaves 2e-9 of it.
_APART = 1e-4


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
    reason : why Hessians are differences of gradients; empty where they are exact
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
    reason: str = field(default="", init=False)
    _last: tuple[Array, Sensitivities] | None = field(default=None, init=False)
    _slope: tuple[Array, float, Array] | None = field(default=None, init=False)

    @property
    def spent(self) -> tuple[int, int, int]:
        """Runs, adjoint runs and tangents until now."""
        return self.runs, self.adjoints, self.tangents

    def spend(self, more: tuple[int, int, int]) -> None:
        """Count what another response has cost."""
        self._spend(*more)

    def _spend(self, runs: int, adjoints: int = 0, tangents: int = 0) -> None:
        self.runs, self.adjoints, self.tangents = self.runs + runs, self.adjoints + adjoints, self.tangents + tangents

    @property
    def _functional(self) -> str:
        return f"final({self.output})"

    @property
    def size(self) -> int:
        return len(self.variables)

    def values(self, points: Array) -> Array:
        """Return the output (m,) at points (m, n), not a number where a run failed."""
        return self.samples(points)[0]

    def samples(self, points: Array) -> tuple[Array, Array]:
        """Return the output at the end of runs (m,), and its largest value within each, at points (m, n)."""
        self._spend(len(points))
        table = dict(zip(self.variables, points.T, strict=True))
        found = self.model.simulate_many(
            *self.span, table=table, columns=[f"output.{self.output}"], points=2, **self.options
        )
        self.failed += len(found.failed)
        final, highest = (found.results[f"output.{self.output}.{which}"] for which in ("final", "max"))
        return np.asarray(final, dtype=float), np.asarray(highest, dtype=float)

    def expansion(self, point: Array) -> Expansion:
        """Return the output with its gradient (n,) and Hessian (n, n): one run, its tangents in all directions, and
        adjoint runs."""
        value, gradient = self.gradient(point)
        found = self._sensitivities(point)
        hessian = self._exactly(lambda: found.hessian(self._functional))
        if hessian is None:
            hessian = self._differenced(point, np.eye(self.size))
        else:
            self._spend(0, 1, self.size)
        return Expansion(value, gradient, 0.5 * (hessian + hessian.T))

    def products(self, point: Array, directions: Array) -> Array:
        """Return the Hessian at a point times directions (n, r), (n, r): for each direction a tangent, and the adjoint
        of that."""
        count = directions.shape[1]
        found = self._sensitivities(point)
        products = self._exactly(lambda: found.hessian_products(self._functional, directions))
        if products is None:
            return self._differenced(point, directions)
        self._spend(0, 1 + count, count)
        return products

    def _exactly(self, derived: Callable[[], Array]) -> Array | None:
        """Return exact second derivatives; None of scenes that have none, which is noted."""
        if self.reason:
            return None
        try:
            return derived()
        except UsageError as error:
            self.reason = error.problems[0].what
            return None

    def _differenced(self, point: Array, directions: Array) -> Array:
        """Return the Hessian times directions (n, r), (n, r): differences of exact gradients."""
        found = np.empty_like(directions)
        for k, ahead in enumerate(_APART * directions.T):
            found[:, k] = (self.gradient(point + ahead)[1] - self.gradient(point - ahead)[1]) / (2.0 * _APART)
        return found

    def gradient(self, point: Array) -> tuple[float, Array]:
        """Return the output, and its derivatives (n,) by one adjoint run; those before where the point is the same."""
        if self._slope is None or not np.array_equal(self._slope[0], point):
            found = self._sensitivities(point)
            value, gradient = float(component(found.outputs, self.output)[-1]), found.gradients([self._functional])[0]
            self._slope = np.array(point), value, gradient
            self._spend(0, 1)
        return self._slope[1], self._slope[2]

    def along(self, point: Array) -> tuple[Array, Array, Array]:
        """Return times (rows,), the output (rows,) and its derivatives (rows, n), by tangents along one run."""
        self._spend(0, 0, self.size)
        found = self._sensitivities(point)
        return found.t, component(found.outputs, self.output), component(found.derivatives, self.output)

    def ending(self, time: float) -> RunResponse:
        """Return the response at another end, which counts for itself."""
        return replace(self, span=(time, self.span[1]))

    def _sensitivities(self, point: Array) -> Sensitivities:
        """Return derivatives of the run at a point, the one before where it is the same."""
        if self._last is None or not np.array_equal(self._last[0], point):
            self._last = np.array(point), self._begun(point)
            self._spend(1)
        return self._last[1]

    def _begun(self, point: Array) -> Sensitivities:
        given = dict(self.options)
        parameters = {**(given.pop("parameters", None) or {}), **dict(zip(self.variables, point.tolist(), strict=True))}
        settings = {**newton_settings(self.model, given.get("method")), **(given.pop("settings", None) or {})}
        name = self.output.partition("[")[0]
        given |= {"by": list(self.variables), "of": [name], "parameters": parameters}
        try:
            return self.model.sensitivities(*self.span, settings=settings or None, **given)
        except NumericalError as error:
            far = float(np.linalg.norm(point))
            what = f"the run {far:.3g} standard deviations from the mean fails: {error.problems[0].what}"
            raise NumericalError(what, "smaller steps, or thresholds nearer to the mean") from error
