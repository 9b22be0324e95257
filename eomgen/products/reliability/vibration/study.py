"""The distribution of an output of a scene under random processes: by expansions at the mean, at most probable points,
and by samples."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import with_options_of
from eomgen.base.data import dataclass, field
from eomgen.compiled.arguments import number_of
from eomgen.errors import EomgenError, Message, NumericalError, Problem, UsageError
from eomgen.products.derivatives.crossings import CrossedJump
from eomgen.products.derivatives.linearise import sensitivities
from eomgen.products.reliability.tails.distribution import Draws, steepest_descent
from eomgen.products.reliability.tails.most_probable_point import (
    JUMPING,
    MostProbablePoint,
    UnreachedThreshold,
    points_on_curve,
    searched_points,
)
from eomgen.products.reliability.tails.quadratic_form import (
    ProjectedResponse,
    QuadraticForm,
    hermite_projection,
    leading_directions,
)
from eomgen.products.reliability.vibration.distributions import (
    ACCURACY,
    FEWEST_SEEN,
    at_points,
    correct_by_samples,
    counted_instead,
    disagreements,
    doubts_of_forms,
    empirical_distribution,
    further_points,
    notes_on_unreached,
    relative_errors,
    spread,
    tails_of,
    why_gradient_changes,
    without,
)
from eomgen.products.reliability.vibration.inputs import (
    FEWEST,
    check_output,
    check_samples,
    checked_options,
    cut_processes,
    doubts_of_spread,
    doubts_of_truncation,
    lost_variance,
    numbers_of,
    processes_of,
    span_of,
    thresholds_of,
    truncated_processes,
)
from eomgen.products.reliability.vibration.result import Cost, Distribution, RandomVibration
from eomgen.products.reliability.vibration.run_response import (
    RunResponse,
    first_passage,
    judged_passage,
    not_normal,
    rows_at,
)
from eomgen.results.error_estimate import NOTICED, SampleErrors
from eomgen.simulation.option_types import SensitivityOptions

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

#: Samples that check the quadratic form at the mean.
_TRIED = 32
#: Distributions that are samples' own.
_SAMPLED = ("corrected", "importance_sampling", "monte_carlo")


@with_options_of(sensitivities, SensitivityOptions.__annotations__)
def random_vibration(
    model: Model,
    output: str,
    at: float | None = None,
    step: float | None = None,
    *,
    thresholds: Sequence[float] | None = None,
    points: bool = True,
    projected: float | None = None,
    whole: bool = True,
    samples: int = 0,
    tail_samples: int = 0,
    pairs: int = 0,
    times: Sequence[float] = (),
    levels: Sequence[float] = (),
    seed: int = 0,
    **options: Unpack[SensitivityOptions],
) -> RandomVibration:
    """Return the distribution of an output at a time, and the cost of each method.

    The methods about the mean are always checked by samples, 32 to 1000 runs; doubts are ``notes`` of the result.

    Parameters
    ----------
    output : str
        An output, or a component of an output: ``tip[0]``.
    at, step : float
        Time of the distribution and step, s; by default the end of the run and the step of the scene's simulation. The
        run to ``at`` is a whole number of steps.
    thresholds : sequence of float
        Values of the output for its distribution; by default eleven, which a normal distribution of the output's mean
        and deviation has with probabilities from 1e-4 to 0.9999.
    points : bool
        Search for the most probable point of each threshold: FORM, SORM, quadratic forms there.
    projected : float
        Share, below 1, of the squares of the output's gradients along the run whose directions have a Hessian. This is
        second-order projected differentiation (PD2).
    whole : bool
        Take Hessians in all directions; otherwise all Hessians are projected, and ``projected`` is needed.
    samples : int
        Number of samples of Monte Carlo, 0 for none.
    tail_samples : int
        Number of samples of importance sampling about the most probable point of each threshold, 0 for none; without
        effect if ``points`` is False.
    pairs : int
        Pairs of points of the Hermite projection, 0 for none.
    times : sequence of float
        Other times, s, ends of steps of the run, for the covariance with the output at ``at``.
    levels : sequence of float
        Levels for the first passage within the run, from below; an output that starts above a level has passed.
    seed : int
        Of samples, of pairs of points, and of the random directions of searches.
    method, rho_inf, alpha, beta, gamma, initial, parameters, inputs, record_every, t_start, settings : as of
        ``simulate``; the method is the scene's by default, ``record_every`` can be 1 only, ``parameters`` are by name.

    Returns
    -------
    RandomVibration
        With moments, probabilities of the thresholds and the cost of each method. A threshold without a most probable
        point has the index nan, and a note.

    Raises
    ------
    UsageError
        Forces that jump along the motion, without samples; counts below 0, 1 to 19 samples, a level, threshold or time
        that is not finite, a share not between 0 and 1, a run that is not a whole number of steps, ``times`` that are
        not ends of steps, no random process, no such output, values for variables of a process, a method without
        derivatives of runs; with ``points`` or without ``thresholds``, an output that does not depend on the processes
        to second order.
    NumericalError
        No threshold is reached, and neither samples nor ``times`` nor ``levels`` give other results; the run about the
        mean fails; fewer than 20 samples succeed.

    References
    ----------
    Papadimitriou, Mourelatos, Hu: Nonlinear random vibration analysis using second-order adjoint and projected
    differentiation (2021).
    """
    for name, count in {"samples": samples, "tail_samples": tail_samples, "pairs": pairs, "seed": seed}.items():
        count_of(name, count, 0)
    check_samples(samples=samples, tail_samples=tail_samples)
    levels = numbers_of("levels", levels, "levels=[1.5]", least=0).tolist()
    times = numbers_of("times", times, "times=[1.0, 2.0]", least=0).tolist()
    if thresholds is not None:
        thresholds = numbers_of("thresholds", thresholds, "thresholds=[0.5, 1.0]").tolist()
    _check_projection(projected, whole)
    processes, variables = processes_of(model)
    checked = checked_options(options, variables, [process.name for process in processes])
    span = span_of(model, at, step, number_of("t_start", checked.get("t_start", 0.0)))
    check_output(model, output)
    study = _VibrationStudy(RunResponse(model, variables, output, span, checked), seed, samples)
    try:
        forms = study.expansions(projected, whole, pairs)
    except CrossedJump as error:
        study.left_to_samples(error, "samples alone are left [W0072]")
        forms, points = {}, False
    form = forms.get("second_order", forms.get("projected"))
    best = forms.get("hermite", form)
    mean, deviation = study.sampled_spread() if best is None else (best.mean, best.standard_deviation)
    varies = deviation > 0.0 or study.varies()
    wanted = thresholds_of(mean, deviation, thresholds, needs_spread=points, varies=varies)
    study.notes += doubts_of_spread(mean, deviation, varies=varies)
    study.distributions = {
        name: Distribution.without_samples(*steepest_descent(of, wanted)) for name, of in forms.items()
    }
    others = bool(samples or len(times) or levels)
    indices = study.about_points(wanted, tail_samples, others) if points else np.full(len(wanted), np.nan)
    passage: dict[float, dict[str, float]] = {float(level): {} for level in levels}
    if samples:
        study.by_samples(wanted, passage)
    covariance = study.along(times, passage, forms) if forms and (len(times) or levels) else {}
    if form is not None:
        study.check_form(form)
        study.check_truncation(form)
    study.check_passages(passage, forms.get("first_order"))
    study.check_steps(output, deviation)
    if study.response.reason:
        study.notes.append(f"Hessians are differences of gradients: {study.response.reason} [W0065]")
    units = {item.name: item.unit for item in model.description.outputs}
    return RandomVibration(
        model.name,
        output,
        units.get(output.partition("[")[0], ""),
        span[0],
        processes,
        wanted,
        study.moments,
        study.distributions,
        indices,
        np.asarray(times if forms else (), dtype=float),
        covariance,
        passage,
        study.costs,
        tuple(map(Message, study.notes)),
        study.error,
        study.errors,
        study.lost_variance,
    )


def judge_truncation(response: RunResponse, gradient: Array, *, linear: bool) -> tuple[float, list[str]]:
    """Return the share of an output's variance that is lost with the modes left out, NaN if unknown, and notes.

    The notes concern the lost share or, if unknown, processes whose last modes matter; the list is empty if all is
    well.

    Parameters
    ----------
    response : the output of a run, whose model has processes with modes left out
    gradient : (n,), of the output in the n standard normal variables, about the mean
    linear : whether the output is linear in the variables
    """
    cut, lost = cut_processes(response.model), float("nan")
    # some methods have no derivatives in all rows of inputs: then the shares of the processes are noted
    with suppress(UsageError):
        lost = lost_variance(cut, *response.by_inputs(), response.variables, gradient)
    if np.isnan(lost):
        return lost, truncated_processes(response.model, response.variables, gradient)
    return lost, doubts_of_truncation(lost, cut, linear=linear)


def judge_truncated_outputs(
    model: Model, outputs: Sequence[str], varied: Collection[str], span: tuple[float, float], options: Mapping[str, Any]
) -> list[str]:
    """Return notes of an ensemble on outputs that lose variance with the modes left out of random processes.

    The list is empty if no modes are left out, or if no random process is varied; an output without derivatives about
    the mean has no note. Each output takes a run about the mean and adjoint runs.

    Parameters
    ----------
    outputs : names of components, ``tip[0]``
    varied : names of varied variables and processes
    span : t_end and step, s
    options : of the run about the mean; options without meaning for ``sensitivities`` are ignored
    """
    if not cut_processes(model):
        return []
    processes, variables = processes_of(model)
    if not {*variables, *(process.name for process in processes)}.intersection(varied):
        return []
    run_options = {name: value for name, value in options.items() if name in SensitivityOptions.__annotations__}
    values = model.parameter_array(options.get("parameters")).tolist()
    run_options |= {"parameters": dict(zip(model.parameters, values, strict=True)), "record_every": 1}
    notes = []
    for output in outputs:
        response = RunResponse(model, variables, output, span, run_options)
        with suppress(EomgenError):  # a run about the mean without derivatives
            gradient = response.gradient(np.zeros(response.size))[1]
            notes += [f"output {output}: {note}" for note in judge_truncation(response, gradient, linear=False)[1]]
    return notes


@dataclass
class _VibrationStudy:
    """A study of one output in progress: its methods fill distributions, moments, costs and notes, step by step.

    Attributes
    ----------
    response : the output, whose solutions of the equations of motion are counted
    seed : of samples
    samples : number of Monte Carlo samples; if 0, an error of derivatives is raised
    directions : (n, r) directions with a Hessian; None if all directions have one
    moments : mean, standard deviation, skewness and excess kurtosis by method
    distributions, costs : by method
    notes : doubts, as sentences
    errors : relative errors of probabilities by method, (thresholds,)
    error : estimated discretisation errors of samples
    lost_variance : share that is lost with the modes left out; NaN if unknown
    """

    response: RunResponse
    seed: int
    samples: int = 0
    directions: Array | None = field(default=None, init=False)
    moments: dict[str, tuple[float, float, float, float]] = field(default_factory=dict, init=False)
    distributions: dict[str, Distribution] = field(default_factory=dict, init=False)
    costs: dict[str, Cost] = field(default_factory=dict, init=False)
    notes: list[str] = field(default_factory=list, init=False)
    errors: dict[str, Array] = field(default_factory=dict, init=False)
    error: SampleErrors = field(default_factory=SampleErrors, init=False)
    lost_variance: float = field(default=float("nan"), init=False)
    _of_steps: list[str] = field(default_factory=list, init=False)

    @contextmanager
    def _count_costs(self, name: str) -> Iterator[None]:
        before = np.array(self.response.costs) - list(vars(self.costs.get(name, Cost(0, 0, 0))).values())
        yield
        self.costs[name] = Cost(*(self.response.costs - before).tolist())

    @cached_property
    def about_mean(self) -> Draws:
        """Samples about the mean, the first of which are run with estimates of the errors of steps."""
        return Draws(self._run_about_mean, np.zeros(self.response.size), self.seed + 1)

    def _run_about_mean(self, points: Array) -> tuple[Array, ...]:
        if self.error.available or self._of_steps:
            return self.response.samples(points)
        result, self.error, notes = self.response.samples_with_errors(points)
        self._of_steps = [*notes] or [""]
        return result

    @cached_property
    def _run(self) -> tuple[Array, Array, Array]:
        """Times, the output and the gradients along the run about the mean, solved once."""
        return self.response.along(np.zeros(self.response.size))

    @property
    def _response_with_hessians(self) -> RunResponse | ProjectedResponse:
        """The response with the Hessians that are asked for."""
        return self.response if self.directions is None else ProjectedResponse(self.response, self.directions)

    def expansions(self, projected: float | None, whole: bool, pairs: int) -> dict[str, QuadraticForm]:
        """Return quadratic forms of the output by method: "first_order", without Hessian, always; the others on demand.
        Other names are "projected", "second_order" (if `whole`), all about the mean, and "hermite" for an average over
        `pairs` of points (if not 0). ``projected`` is a share of the squares of gradients along the run, and sets
        ``directions``, which `whole` resets to None. Costs are counted and moments kept by name."""
        origin, forms = np.zeros(self.response.size), {}
        if projected is not None:
            with self._count_costs("projected"):
                self.directions = leading_directions(self._run[2], projected)
                forms["projected"] = self._response_with_hessians.expansion(origin).form
        if whole:
            self.directions = None
            with self._count_costs("second_order"):
                forms["second_order"] = self.response.expansion(origin).form
        form = forms["second_order" if whole else "projected"]
        forms = {"first_order": QuadraticForm(form.value, form.gradient, 0.0 * form.hessian), **forms}
        if pairs:
            with self._count_costs("hermite"):
                forms["hermite"] = hermite_projection(self._response_with_hessians, pairs, self.seed)
        self.moments = {name: of.moments for name, of in forms.items()}
        return forms

    def varies(self) -> bool:
        """Return whether a few samples differ."""
        _, y, _ = self.about_mean.first(_TRIED)
        known = y[np.isfinite(y)]
        return len(known) > 0 and bool(np.ptp(known) > 0.0)

    def check_form(self, form: QuadraticForm) -> None:
        """Compare the quadratic form about the mean with 32 samples; if both differ by much, correct its moments by
        400. The corrected mean and standard deviation are added to ``moments`` as "corrected", with a note. Failed
        samples are noted. The form is not changed, and without spread of the samples there is no comparison."""
        with self._count_costs("check"):
            z, y, _ = self.about_mean.first(_TRIED)
        failed = int(np.count_nonzero(~np.isfinite(y)))
        if failed:
            self.notes.append(
                f"{failed} of {len(y)} samples fail, so the statistics of the output leave them out [W0066]"
            )
        if len(y) - failed < 2 or not np.nanvar(y) > 0.0:
            return
        if float(np.sqrt(np.nanmean((y - form.values(z)) ** 2) / np.nanvar(y))) <= ACCURACY:
            return
        with self._count_costs("check"):
            z, y, _ = self.about_mean.first(400)
        known = np.isfinite(y)
        y, ours = y[known], form.values(z[known])
        missed = float(np.sqrt(np.mean((y - ours) ** 2) / np.var(y)))
        squares = (y - y.mean()) ** 2 - (ours - ours.mean()) ** 2
        variance = form.standard_deviation**2 + float(squares.mean())
        error = float(squares.std()) / np.sqrt(len(y))
        plain = (y - y.mean()) ** 2
        if not variance > 0.0 or float(plain.std()) / np.sqrt(len(y)) < error:  # the form is of no use
            variance, error = float(np.var(y)), float(plain.std()) / np.sqrt(len(y))
        deviation = float(np.sqrt(variance))
        self.moments["corrected"] = form.mean + float(np.mean(y - ours)), deviation, float("nan"), float("nan")
        self.notes.append(
            f"the quadratic form about the mean misses {len(y)} samples by {missed:.2g} of their standard deviation:"
            f" these correct the standard deviation from {form.standard_deviation:.4g} to {deviation:.4g} +-"
            f" {error / deviation:.1g}, and distributions about the mean are a guess [W0067]"
        )

    def check_steps(self, output: str, deviation: float) -> None:
        """Add notes on discretisation errors of 32 samples, and on random processes that the steps do not resolve. The
        error of the output is noted if not small relative to the output's standard deviation `deviation`."""
        with self._count_costs("check"):
            self.about_mean.first(_TRIED)
        off = self.error.columns.get(f"output.{output}", float("nan"))
        if off > NOTICED * deviation > 0.0:
            self.notes.append(
                f"the steps put the output off by up to {off:.2g}, {100.0 * off / deviation:.2g} % of its standard"
                f" deviation; try: a step smaller than {self.response.span[1]:.3g} s [W0068]"
            )
        self.notes += filter(None, self._of_steps)

    def check_truncation(self, form: QuadraticForm) -> None:
        """Evaluate the share of the output's variance that is lost by truncation, and note a share that matters."""
        if not cut_processes(self.response.model):
            return
        with self._count_costs("truncation"):
            self.lost_variance, notes = judge_truncation(self.response, form.gradient, linear=form.linear)
        self.notes += notes

    def check_passages(self, passage: dict[float, dict[str, float]], normal: QuadraticForm | None) -> None:
        """Compare first-passage probabilities by the crossing rate with samples, and set "preferred" for each level.
        ``passage`` is changed in place: by level, probabilities by method ("crossing_rate", "monte_carlo", "samples",
        "preferred"). Preferred is the rate; samples that contradict the rate, with a note; Monte Carlo without a rate.
        Monte Carlo samples are compared if at least 1000, else 1000 about the mean, whose share is added as "samples"
        if the study has no Monte Carlo samples. `normal` is the form of first order: a level that few samples pass is
        noted, without a contradiction, if the samples deviate from a normal distribution; None for no such check."""
        if not passage:
            return
        with self._count_costs("check"):
            y, highest = self._monte_carlo if self.samples >= 1000 else self.about_mean.first(1000)[1:]
        known = np.isfinite(y) & np.isfinite(highest)
        y, highest = y[known], highest[known]
        bent = "" if normal is None else not_normal(y, normal.mean, normal.standard_deviation)
        for level, values in passage.items():
            passed = int(np.count_nonzero(highest > level))
            if not self.samples:
                values["samples"] = passed / len(highest)
            if "crossing_rate" not in values:
                values["preferred"] = values["monte_carlo"]
                continue
            counts = passed, len(highest)
            values["preferred"], note = judged_passage(level, values["crossing_rate"], *counts, normal=not bent)
            if not note and bent and passed < FEWEST_SEEN:
                note = f"the first passage of {level:.6g} by the rate of crossings is a guess: {bent} [W0070]"
            self.notes += [note] if note else []

    def about_points(self, wanted: Array, tail_samples: int, others: bool) -> Array:
        """Compute most probable points and the distributions about these points; return reliability indices,
        (thresholds,).

        Indices are NaN for thresholds without a point. The distributions at the points and the "corrected" one are
        added to ``distributions``, the errors of all methods to ``errors``, doubts to ``notes``. Raises
        UnreachedThreshold if no threshold has a result and no others remain.

        Parameters
        ----------
        wanted : (thresholds,), values of the output
        tail_samples : number of samples of importance sampling about each point, 0 for none
        others : whether further results remain if the search fails
        """
        none = np.full(len(wanted), np.nan)
        try:
            with self._count_costs("most_probable_points"):
                points, missed = self._points(wanted)
        except (CrossedJump, NumericalError) as error:
            self.left_to_samples(error, "most probable points are left out [W0073]")
            return none
        places, reached = sorted(points), [points[k] for k in sorted(points)]
        self.notes += self._doubts_of_rough(reached)
        with self._count_costs("other_points"):
            further, not_nearest = further_points(self._response_with_hessians, reached, self.seed)
            self.notes += not_nearest
        about = at_points(reached) if reached else {}
        failed = self.response.failed
        with self._count_costs("corrected"):
            forms = spread(about["quadratic"], places, len(wanted)) if reached else Distribution(none, none, none, none)
            more = {places[k]: some for k, some in further.items()}
            whole, unknown = correct_by_samples(self.response, wanted, points, forms, self.about_mean, more, self.seed)
            whole, contradicted = counted_instead(wanted, whole, self.about_mean)
        if not points and not others and np.isnan(whole.below).all():
            first = missed[min(missed)]
            why = why_gradient_changes(self.response.kinks()) if first.why == JUMPING else first.why
            raise UnreachedThreshold(first.last, float(wanted[min(missed)]), why)
        self.notes += [*notes_on_unreached(missed, wanted, self.response.kinks), *unknown, *contradicted]
        if tail_samples and reached:
            with self._count_costs("importance_sampling"):
                about["importance_sampling"] = tails_of(self.response, reached, tail_samples, self.seed)
        failed = self.response.failed - failed
        if failed:
            self.notes.append(
                f"{failed} samples about most probable points failed: thresholds with such have none [W0071]"
            )
        wide = {name: spread(distribution, places, len(wanted)) for name, distribution in about.items()}
        known = self.distributions | wide
        self.errors = {name: relative_errors(part, whole) for name, part in known.items() if name not in _SAMPLED}
        indices = none.copy()
        if reached:
            true = Distribution(*(part[places] for part in vars(whole).values()))
            errors = {name: values[places] for name, values in self.errors.items()}
            self.notes += doubts_of_forms(wanted[places], errors, true)
            ending = "samples: the response is not a quadratic form there, and the form is left out; take `corrected`"
            wrong = disagreements(wanted, wide["quadratic"], whole, ending)
            self.notes += wrong.values()
            wide["quadratic"] = without(wide["quadratic"], wrong)
            indices[places] = [point.index for point in reached]
        self.distributions |= {**wide, "corrected": whole}
        return indices

    def _points(self, wanted: Array) -> tuple[dict[int, MostProbablePoint], dict[int, UnreachedThreshold]]:
        """Return the most probable points of thresholds ``wanted`` (n,), and reasons for missing ones, by number of
        threshold. The points are on the curve from the mean. If the curve does not come to a threshold, as for a
        response without slope at the mean, searches start from random directions; a threshold without result keeps its
        reason."""
        points, missed = points_on_curve(self._response_with_hessians, wanted.tolist(), self.response.kinks)
        for k in sorted(missed):
            if some := searched_points(self._response_with_hessians, float(wanted[k]), 2, self.seed):
                points[k] = some[0]
                del missed[k]
        return points, missed

    def _doubts_of_rough(self, reached: Sequence[MostProbablePoint]) -> list[str]:
        """Return a list with one note on points next to a jump of the gradient, which have reduced accuracy (``aside``
        is not 0); empty without such points."""
        rough = [point for point in reached if point.aside]
        if not rough:
            return []
        by = ", ".join(self.response.kinks())
        names = ", ".join(f"{point.threshold:.6g}" for point in rough)
        aside = max(point.aside for point in rough)
        return [
            f"most probable points of {names} are known to {aside:.1g} standard deviations alone: the gradient jumps"
            f" there{f' by {by}' if by else ''}; quadratic forms lack the jump, and samples correct them"
        ]

    def left_to_samples(self, error: CrossedJump | NumericalError, left: str) -> None:
        """Note that derivatives fail, and that only samples give results; `left` begins the note, such as "samples
        alone are left". Without samples the error is raised instead, for a CrossedJump with advice to take samples."""
        fault = error.problems[0].what
        if self.samples:
            self.notes.append(f"{left}: {fault}")
        elif isinstance(error, NumericalError):
            raise error
        else:
            hint = "samples=4000 (--monte-carlo 4000), which take no derivatives"
            raise CrossedJump(Problem("random_vibration", fault, hint))

    def sampled_spread(self) -> tuple[float, float]:
        """Return the mean and the standard deviation of samples."""
        y = self._monte_carlo[0]
        return float(np.nanmean(y)), float(np.nanstd(y))

    @cached_property
    def _monte_carlo(self) -> tuple[Array, Array]:
        """The output at the end of Monte Carlo runs, and the largest output within each run, (samples,) each. Failed
        runs have NaN. Raises NumericalError if too few runs succeed."""
        count = self.samples
        with self._count_costs("monte_carlo"):
            normal = np.random.default_rng(self.seed).standard_normal((count, self.response.size))
            y, highest = self.response.samples(normal)
        failed = int(np.count_nonzero(~np.isfinite(y)))
        if count - failed < FEWEST:
            fault = f"{'all' if failed == count else f'{failed} of'} {count} samples of Monte Carlo fail [E1051]"
            raise NumericalError(fault, "smaller steps, or a scene that runs")
        return y, highest

    def by_samples(self, wanted: Array, passage: dict[float, dict[str, float]]) -> None:
        """Add the Monte Carlo distribution at thresholds `wanted` (n,) and the moments of the samples to the results.
        In ``passage`` each level gets "monte_carlo", the share of runs whose largest output exceeds the level. Failed
        samples are left out and noted. Probabilities of quadratic forms at most probable points that the samples
        contradict become NaN, with a note."""
        y, highest = self._monte_carlo
        failed = int(np.count_nonzero(~np.isfinite(y)))
        statistics = empirical_distribution(y[np.isfinite(y)], wanted)
        self.distributions["monte_carlo"], self.moments["monte_carlo"] = statistics
        for level, values in passage.items():
            values["monte_carlo"] = float(np.mean(highest[np.isfinite(highest)] > level))
        if failed:
            self.notes.append(f"{failed} of {len(y)} samples failed, and are in no statistics [W0074]")
        if "quadratic" in self.distributions:
            form, counted = self.distributions["quadratic"], self.distributions["monte_carlo"]
            ending = "Monte Carlo: the form is left out, trust samples"
            wrong = disagreements(wanted, form, counted, ending)
            self.notes += wrong.values()
            self.distributions["quadratic"] = without(form, wrong)

    def along(
        self, times: Sequence[float], passage: dict[float, dict[str, float]], forms: dict[str, QuadraticForm]
    ) -> dict[str, Array]:
        """Set first-passage probabilities by the crossing rate, and return covariances of the output with its final
        value. ``passage`` gets "crossing_rate" for each level, in place. The covariances at the times (m,) are
        arrays (m,) by method: "first_order", and "second_order" or "projected" as the Hessians are; an empty dict
        without times. `forms` are the quadratic forms about the mean by method. Raises UsageError for a time that is
        not a row."""
        with self._count_costs("along_the_run"):
            t, y, slopes = self._run
        for level, values in passage.items():
            values["crossing_rate"] = first_passage(t, y, slopes, level)
            if y[0] >= level and not np.any(slopes[0]):
                self.notes.append(
                    f"the output starts at {y[0]:.6g}, not below the level {level:.6g}, and counts as passed [W0075]"
                )
        if not len(times):
            return {}
        rows = rows_at(t, times)
        result = {"first_order": slopes[rows] @ forms["first_order"].gradient}
        name = "second_order" if self.directions is None else "projected"
        with self._count_costs("autocovariance"):
            result[name] = np.array([forms[name].covariance(self._form_at(float(t[row]))) for row in rows])
        return result

    def _form_at(self, time: float) -> QuadraticForm:
        """Return the quadratic form of the output at another time, s, about the mean motion; the zero form at times up
        to 0. The solutions are added to the costs of the study's response."""
        size = self.response.size
        if time <= 0.0:
            return QuadraticForm(0.0, np.zeros(size), np.zeros((size, size)))
        response = self.response.ending(time)
        expanded = response if self.directions is None else ProjectedResponse(response, self.directions)
        form = expanded.expansion(np.zeros(size)).form
        self.response.spend(*response.costs)
        return form


def _check_projection(projected: float | None, whole: bool) -> None:
    if projected is not None and not 0.0 < number_of("projected", projected, "number") < 1.0:
        fault = f"the share {projected:.6g} is not between 0 and 1 [E1027]"
        raise UsageError(Problem("projected", fault, "projected=0.999"))
    if projected is None and not whole:
        fault = "no Hessian is left without the whole one [E1052]"
        raise UsageError(Problem("whole", fault, "projected=0.999, the share of the directions that have one"))
