"""An output of a run at one time as a response to the standard normal variables of the scene's random processes, and
its rows over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.products.derivatives.functionals import component
from eomgen.products.derivatives.linearise import newton_settings
from eomgen.products.reliability.tails.quadratic_form import ResponseExpansion
from eomgen.results.error_estimate import SampleErrors

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.products.derivatives.run_sensitivities import Sensitivities
    from eomgen.products.derivatives.stationary_run import StationaryRun

Derived = TypeVar("Derived")


@dataclass
class RunResponse:
    """One output at the end of runs as a function of n standard normal variables, a ``Response``.

    Evaluations are counted, and the last derivatives kept.

    Attributes
    ----------
    variables : names of the tunable parameters that are standard normal, n
    output : name of an output, or of a component, ``tip[0]``
    span : t_end and step, s
    options : of ``simulate``
    costs : numbers of solutions of the equations of motion, and of the linearised equations backwards and forwards in
        time
    failed : number of samples whose runs failed
    reason : reason for Hessians by differences of gradients; empty if Hessians are exact
    """

    model: Model
    variables: Sequence[str]
    output: str
    span: tuple[float, float]
    options: Mapping[str, Any]
    costs: tuple[int, int, int] = field(default=(0, 0, 0), init=False)
    failed: int = field(default=0, init=False)
    reason: str = field(default="", init=False)
    _last: tuple[Array, Sensitivities] | None = field(default=None, init=False)
    _slope: tuple[Array, float, Array] | None = field(default=None, init=False)
    _longer: RunResponse | None = field(default=None, init=False)

    def spend(self, runs: int, adjoints: int = 0, tangents: int = 0) -> None:
        """Count solutions, also of another response."""
        before = self.costs
        self.costs = before[0] + runs, before[1] + adjoints, before[2] + tangents

    @property
    def size(self) -> int:
        return len(self.variables)

    def values(self, points: Array) -> Array:
        """Return the output (m,) at points (m, n), not a number if a run failed."""
        return self.samples(points)[0]

    def samples(self, points: Array) -> tuple[Array, Array]:
        """Return the output at the end of runs (m,), and the largest value within each run, at points (m, n)."""
        return self.samples_with_errors(points, error_estimate=False)[0]

    def samples_with_errors(
        self, points: Array, *, error_estimate: bool = True
    ) -> tuple[tuple[Array, Array], SampleErrors, tuple[str, ...]]:
        """Return ``samples``, with estimated errors of a few samples and notes on steps."""
        self.spend(len(points))
        result = self.model.simulate_many(
            *self.span,
            table=dict(zip(self.variables, points.T, strict=True)),
            columns=[f"output.{self.output}"],
            points=2,
            error_estimate=error_estimate,
            **self.options,
        )
        self.failed += len(result.failed)
        final, highest = (result.results[f"output.{self.output}.{which}"] for which in ("final", "max"))
        if not error_estimate:
            return (final, highest), SampleErrors(), ()
        return (final, highest), result.error, result.judgement.of_steps

    def kinks(self) -> list[str]:
        """Return operations of the equations at which slopes jump with the motion, in words; found once."""
        return self._kinks

    @cached_property
    def _kinks(self) -> list[str]:
        model, name = self.model, self.output.partition("[")[0]
        owners = [item["name"] for item in model.library.layout["outputs"] for _ in range(int(item["size"]))]
        places = slice(owners.index(name), owners.index(name) + owners.count(name)) if name in owners else slice(0)
        if model.branches is None:
            return []
        moving, names = {"q", "v", "z"}, {"u": list(model.inputs), "p": list(model.parameters)}
        random = {*self.variables, *(item.name for item in model.description.inputs if item.series is not None)}
        kinks = (
            kink
            for kink in model.branches().kinks(places)
            if any(
                symbol.block in moving or names.get(symbol.block, [""])[symbol.index] in random
                for symbol in kink.symbols
            )
        )
        return list(dict.fromkeys(kink.description for kink in kinks))

    def expansion(self, point: Array) -> ResponseExpansion:
        """Return the output with gradient (n,) and Hessian (n, n) at a point (n,). This takes one run, tangents in all
        directions and one adjoint run; about a constant state one adjoint run alone. The Hessian is by differences of
        gradients if the scene has no exact second derivatives, see ``reason``."""
        if (still := self._still_at(point)) is not None:
            return ResponseExpansion(*self.gradient(point), self._bent_still(still, np.eye(self.size)))
        derivatives = self._sensitivities(point)
        derived = self._exactly(lambda: derivatives.expansions([f"final({self.output})"]))
        if derived is None:
            return ResponseExpansion(*self.gradient(point), self._difference_gradients(point, np.eye(self.size)))
        known = self._slope is not None and np.array_equal(self._slope[0], point)
        self.spend(0, 0 if known and derivatives.keeps_adjoints else 1, self.size)
        self._slope = np.array(point), float(component(derivatives.outputs, self.output)[-1]), derived[0][0]
        return ResponseExpansion(*self._slope[1:], derived[1][0])

    @cached_property
    def stationary(self) -> StationaryRun | None:
        """Derivatives at all rows about the mean if the state stays constant there, which takes no run."""
        if self._longer is not None:  # the longer run has the rows up to here
            return self._longer.stationary
        return self._sensitivities_at(np.zeros(self.size)).stationary([self.output])

    def _still_at(self, point: Array) -> StationaryRun | None:
        """Return derivatives about a constant state, if a point is the mean and there is one."""
        return None if np.any(point) else self.stationary

    def _end_of_stationary_run(self, still: StationaryRun) -> tuple[int, float, Array]:
        """Return the row of the end, the output and the gradient (n,) there, and count the adjoints."""
        row, before = int(np.argmin(np.abs(still.t - self.span[0]))), still.solutions
        value, gradient = float(still.outputs[row, 0]), still.gradients[row, 0]
        self.spend(0, still.solutions - before)
        return row, value, gradient

    def _bent_still(self, still: StationaryRun, directions: Array) -> Array:
        """Return the Hessian at the end of a run with a constant state, times directions."""
        row, *_ = self._end_of_stationary_run(still)
        before = still.solutions
        hessian = self._exactly(lambda: still.hessian(0, row))
        self.spend(0, still.solutions - before)
        return self._difference_gradients(np.zeros(self.size), directions) if hessian is None else hessian @ directions

    def products(self, point: Array, directions: Array) -> Array:
        """Return the Hessian at a point (n,) times directions (n, r), (n, r). This takes a tangent for each direction
        and the adjoint of that, or differences of gradients if the scene has no exact second derivatives."""
        if (still := self._still_at(point)) is not None:
            return self._bent_still(still, directions)
        count = directions.shape[1]
        derivatives = self._sensitivities(point)
        products = self._exactly(lambda: derivatives.hessian_products(f"final({self.output})", directions))
        if products is None:
            return self._difference_gradients(point, directions)
        self.spend(0, 1 + count, count)
        return products

    def _exactly(self, derived: Callable[[], Derived]) -> Derived | None:
        """Return the result of a function of exact second derivatives; None if the scene has none, and then ``reason``
        is set, after which the function is not called again."""
        if self.reason:
            return None
        try:
            return derived()
        except UsageError as error:
            self.reason = error.problems[0].what
            return None

    def _difference_gradients(self, point: Array, directions: Array) -> Array:
        """Return the Hessian times directions (n, r), (n, r): differences of exact gradients."""
        result, apart = np.empty_like(directions), 1e-4  # a third derivative of order 1 gives an error of 2e-9
        for k, ahead in enumerate(apart * directions.T):
            result[:, k] = (self.gradient(point + ahead)[1] - self.gradient(point - ahead)[1]) / (2.0 * apart)
        return result

    def gradient(self, point: Array) -> tuple[float, Array]:
        """Return the output and its gradient (n,) at a point (n,), by a run and one adjoint run; the kept results if
        the point is the last one."""
        if (still := self._still_at(point)) is not None:
            return self._end_of_stationary_run(still)[1:]
        if self._slope is None or not np.array_equal(self._slope[0], point):
            derivatives = self._sensitivities(point)
            value = float(component(derivatives.outputs, self.output)[-1])
            gradient = derivatives.gradients([f"final({self.output})"])[0]
            self._slope = np.array(point), value, gradient
            self.spend(0, 1)
        return self._slope[1], self._slope[2]

    def along(self, point: Array) -> tuple[Array, Array, Array]:
        """Return times (rows,) in s, the output (rows,) and its derivatives (rows, n) by the variables at each recorded
        row, along the run at a point (n,): by tangents, or about a constant state without a run."""
        if (still := self._still_at(point)) is not None:
            self._end_of_stationary_run(still)
            rows = slice(None, None, still.run.run.every)
            return still.t[rows], still.outputs[rows, 0], still.gradients[rows, 0]
        self.spend(0, 0, self.size)
        result = self._sensitivities(point)
        return result.t, component(result.outputs, self.output), component(result.derivatives, self.output)

    def by_inputs(self) -> tuple[Array, dict[str, Array]]:
        """Return times (rows,) and the derivatives of the output in the values of random processes at these, (rows,)
        each, about the mean: by one run and one adjoint run."""
        self.spend(1, 1)
        result = self._sensitivities_at(np.zeros(self.size), by=self.variables[:1])  # any parameter does
        return result.t, result.input_gradient(f"final({self.output})")

    def ending(self, time: float) -> RunResponse:
        """Return the response at another end time, with separate counts of evaluations; about a constant state no
        further adjoint run is needed."""
        shorter = replace(self, span=(time, self.span[1]))
        shorter._longer = self
        return shorter

    def _sensitivities(self, point: Array) -> Sensitivities:
        """Return derivatives of the run at a point; the previous derivatives if the point is the same."""
        if self._last is None or not np.array_equal(self._last[0], point):
            self._last = np.array(point), self._sensitivities_at(point)
            self.spend(1)
        return self._last[1]

    def _sensitivities_at(self, point: Array, by: Sequence[str] = ()) -> Sensitivities:
        """Return new derivatives of the run at a point (n,), by all variables or the parameters ``by``. Raises
        NumericalError, with the point's distance from the mean, if the run fails, and UsageError for an end ``at``
        without whole steps. Costs are not counted here."""
        options = dict(self.options)
        parameters = {
            **(options.pop("parameters", None) or {}),
            **dict(zip(self.variables, point.tolist(), strict=True)),
        }
        options["method"] = options.get("method") or self.model.library.layout["built_method"]  # never auto
        settings = {**newton_settings(self.model, options["method"]), **(options.pop("settings", None) or {})}
        name = self.output.partition("[")[0]
        options |= {"by": list(by or self.variables), "of": [name], "parameters": parameters}
        try:
            return self.model.sensitivities(*self.span, settings=settings or None, **options)
        except NumericalError as error:
            far = float(np.linalg.norm(point))
            fault = f"the run {far:.3g} standard deviations from the mean fails: {error.problems[0].what} [E1049]"
            raise NumericalError(fault, "smaller steps, or thresholds nearer to the mean") from error
        except UsageError as error:
            problem = error.problems[0]
            if problem.where != "t_end":
                raise
            hint = f"{problem.hint.replace('t_end', 'at')} (--t-end)"
            raise UsageError(replace(problem, where="at", hint=hint)) from None


#: Probability of samples below which they contradict a rate of crossings.
_CHANCE = 1e-3


def chance_of(count: int, samples: int, least: float, most: float) -> float:
    """Return the smaller of the chances that an event comes at least, or at most, ``count`` times among samples; the
    probability of the event is from ``least`` to ``most``."""
    more = float(special.bdtrc(count - 1, samples, most)) if count else 1.0
    return min(more, float(special.bdtr(count, samples, least)))


def rows_at(t: Array, times: Sequence[float]) -> list[int]:
    rows = [int(np.argmin(np.abs(t - time))) for time in times]
    for row, time in zip(rows, times, strict=True):
        if not abs(t[row] - time) <= WRITTEN * np.ptp(t):  # nor not a number
            fault = f"t = {time:.6g} s is not a row of the run; the nearest one is at {t[row]:.9g} s [E1050]"
            raise UsageError(Problem("times", fault, "whole steps within the run"))
    return rows


def first_passage(t: Array, y: Array, slopes: Array, level: float) -> float:
    """Return the probability that the output passes a level from below within the run, by the mean rate of crossings.

    To first order y and the rate of y are Gaussian at every time; crossings are taken as a Poisson process, so a start
    above the level counts as well.

    Parameters
    ----------
    t, y : (n,) ndarray
        Times, s, and the mean output at these times.
    slopes : (n, variables) ndarray
        Derivatives of the output by standard normal variables.
    level : float
        Level, in the unit of the output.

    References
    ----------
    Rice: Mathematical analysis of random noise, Bell Syst. Tech. J. 24 (1945); Ditlevsen, Madsen: Structural
    Reliability Methods (1996), 14.2.
    """
    rates = np.gradient(y, t, edge_order=2)
    slope_rates = np.gradient(slopes, t, axis=0, edge_order=2)
    spread = np.sqrt(np.sum(slopes**2, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (level - y) / spread
        coupling = np.sum(slopes * slope_rates, axis=1) / spread
        mean = rates + coupling * distance
        deviations = np.sqrt(np.maximum(np.sum(slope_rates**2, axis=1) - coupling**2, 0.0))
        ratio = np.where(mean == 0.0, 0.0, mean / deviations)  # neither deviates for a constant y
        density = np.exp(-0.5 * distance**2) / (np.sqrt(2.0 * np.pi) * spread)
        crossings = density * (deviations * np.exp(-0.5 * ratio**2) / np.sqrt(2.0 * np.pi) + mean * special.ndtr(ratio))
    crossings = np.where(spread > 0.0, crossings, 0.0)
    begun = float(special.ndtr(-distance[0])) if spread[0] > 0.0 else float(y[0] > level)
    integral = float(np.sum(0.5 * (crossings[1:] + crossings[:-1]) * np.diff(t)))
    return begun + (1.0 - begun) * -float(np.expm1(-integral))


def judged_passage(level: float, of_rate: float, passed: int, samples: int, *, normal: bool) -> tuple[float, str]:
    """Return the first-passage probability to prefer, and a note if samples contradict the rate of crossings.

    The probability is by the rate with an empty note, or by the share of samples with a note.

    Parameters
    ----------
    level : of the output
    of_rate : probability by the rate of crossings
    passed, samples : how many of the samples pass the level within the run
    normal : whether samples are compatible with a normal response: then crossings that are fewer than their rate says
        come in clumps, as a slightly damped oscillator has them (Vanmarcke 1975)
    """
    share = passed / samples
    chance = chance_of(passed, samples, of_rate, of_rate)
    # the part of a probability, or of its complement, by which both may differ
    alike = 0.2 * min(max(share, of_rate), 1.0 - min(share, of_rate))
    if chance > COMPUTED and (chance > _CHANCE or abs(share - of_rate) <= alike):
        return of_rate, ""
    by = f"{of_rate:.3g} by the rate of crossings of a normal process and {share:.3g} by {samples} samples"
    why = "" if normal else ": the response is not normal"
    if normal and share < of_rate:
        why = ": crossings come in clumps, and the rate takes each as independent of the others"
    return share, f"the first passage of {level:.6g} has probability {by}, which is preferred{why} [W0069]"


def not_normal(y: Array, mean: float, deviation: float) -> str:
    """Return a note if too many or too few samples y (m,) lie more than two standard deviations from the mean of a
    normal distribution; else an empty text."""
    beyond, chance = int(np.count_nonzero(np.abs(y - mean) > 2.0 * deviation)), 2.0 * float(special.ndtr(-2.0))
    if chance_of(beyond, len(y), chance, chance) > _CHANCE:
        return ""
    return (
        f"it takes the response as normal, and {100.0 * beyond / len(y):.2g} % of {len(y)} samples lie more than two"
        f" standard deviations out, not {100.0 * chance:.2g} %"
    )
