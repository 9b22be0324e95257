"""identify: arguments and refusals of an identification of parameters and initial states, starts that are at rest, and
the fit."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.calls import check_options, checked_call, names_of
from eomgen.base.messages import shown
from eomgen.compiled.arguments import check_name, number_of
from eomgen.compiled.initial_state import initial_state
from eomgen.errors import Problem, UsageError
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.studies.identification.estimation import LeastSquares, Predictions
from eomgen.products.studies.identification.experiment import (
    Experiment,
    ExperimentUnknowns,
    bounds_of,
    check_effect,
    deviations_of,
)
from eomgen.products.studies.identification.judgement import Judgement
from eomgen.products.studies.identification.measurements import MISSING, Data, check_choice, measurements
from eomgen.products.studies.identification.result import Identification
from eomgen.products.studies.identification.torques import identified_by_torque
from eomgen.scene.scene import Scene

_WAYS = ("run", "torque")
#: Options of runs, and arguments of this study, which come first among suggestions for an unknown name.
_OF_RUNS = ("method", "rho_inf", "alpha", "beta", "gamma", "inputs", "settings")
_OWN = (
    *("parameters", "states", "values", "initial", "bounds", "deviations", "outputs", "missing", "confidence"),
    *("step", "t_start", "by"),
)
_OF_OTHER_RUNS = {
    "t_end": "data up to there",
    "record_every": "data at the times that are wanted",
    **dict.fromkeys(("tolerance", "order"), "step=..., for fixed steps"),
    **dict.fromkeys(("controllers", "start"), "initial=..., and a scene without sampled states"),
    **dict.fromkeys(("initial_values", "x0"), "initial"),
    **dict.fromkeys(("weights", "sigma"), "deviations"),
    "p0": "values",
}


@checked_call(
    scene="a scene or a model", initial_values="initial", weights="deviations", sigma="deviations", p0="values"
)
def identify(
    scene: Model | Scene | str | os.PathLike[str] | Mapping[str, Any],
    data: Data | Sequence[Data],
    parameters: Sequence[str] = (),
    *,
    states: Sequence[str] = (),
    values: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    deviations: Mapping[str, float] | float | None = None,
    outputs: Sequence[str] | None = None,
    missing: str = "refuse",
    confidence: float = 0.95,
    step: float | None = None,
    t_start: float | None = None,
    by: str = "run",
    **options: Any,
) -> Identification:
    """Return the parameters and initial states of a scene that fit measured runs best, with confidence intervals.

    Least squares of measurements minus outputs of runs, each column divided by the standard deviation, with the exact
    derivatives of the discrete runs. A search that does not converge and unknowns that the data do not determine
    raise no error: ``notes`` and ``Estimate.state`` say so.

    Parameters
    ----------
    scene : model, Scene, path or mapping
        A model saves the build.
    data : path or mapping, or a sequence of paths or mappings
        A CSV file, or columns by name; one for each run. ``t`` are times in s; a column with the name of an output, or
        of a component of an output, ``tip[0]``, is compared with this output; a column with the name of an input drives
        this input, linear in between; columns of states and energies are ignored. Times need not be ends of steps:
        outputs between these are cubic, of order 4 in the step.
    parameters : sequence of str
        Tunable parameters that are unknown.
    states : sequence of str
        Unknown components of the initial state of each run: ``q.hinge``, ``v.hinge``, ``z.filtered``. For a joint that
        rotates, ``q.ball[0]`` is a rotation in rad about the x axis, from the start of the scene.
    values : mapping
        Tunable parameters that differ from the scene's: start values of unknown parameters, values of other parameters.
    initial : mapping, or a sequence of mappings
        Initial state by name, as of ``simulate``, for all runs, or one for each; the scene's if not given. Unknown
        components start there.
    bounds : mapping
        Name -> (low, high), of unknown parameters and states; unbounded by default.
    deviations : mapping or number
        Standard deviations of the noise, of each compared column by name, or a number for all. Without them, deviations
        and intervals are estimated.
    outputs : sequence of str
        Columns that are compared; all that are outputs by default. Further columns are ignored, except inputs.
    missing : str
        Treatment of values that are empty, nan or infinite: ``refuse`` or ``drop``; dropped values of inputs are
        interpolated, and ``torque`` drops whole rows.
    confidence : float
        Confidence level of the intervals.
    step : float
        S; the scene's by default.
    t_start : float
        S, of all runs; the first measured time by default. The initial state belongs to this time.
    by : str
        ``run``: outputs of runs; ``torque``: efforts at each time with q, v and a, by the regressor, from columns
        ``q.hinge``, ``v.hinge``, ``a.hinge``, and ``tau.hinge`` (added to efforts of inputs; 0 without these columns)
        or inputs. Parameters of ``torque`` have the names of ``regressor_parameters``; all base parameters if none is
        named. ``run`` needs a named unknown.
    **options
        ``method``, ``rho_inf``, ``alpha``, ``beta``, ``gamma``, ``settings``, and ``inputs`` without a column, as of
        ``sensitivities``.

    Returns
    -------
    Identification
        Estimates with intervals, correlations, residuals and notes.

    Raises
    ------
    UsageError
        Names that are none, columns that are neither outputs nor inputs, times that do not increase, missing values,
        fewer samples than unknowns, bounds that exclude the start, an unknown without effect, ``t_start`` after the
        first measured time, unknown states of a scene that starts at equilibrium without ``initial``, unknown states
        and parameters of a scene whose start follows from parameters without ``q`` and ``v`` in ``initial``, two runs
        of the same name, a method without derivatives; for ``torque``, arguments of runs: ``states``, ``bounds``,
        ``initial``, ``outputs``, ``step``, ``t_start`` and the options.
    NumericalError
        The run fails at the start of the search.
    FileError
        A file that is missing, or no CSV.
    """
    check_options("identify", options, _OF_RUNS, _OF_OTHER_RUNS, _OWN)
    model = scene if isinstance(scene, Model) else build_for_run(scene, options.get("method"))
    _check_lists(parameters=parameters, states=states)
    check_choice("missing", missing, MISSING)
    check_choice("by", by, _WAYS)
    held, share, entries = _parameter_values(model, values), _share(confidence), _several(data)
    if by == "torque":
        of_runs = {"states": states or None, "bounds": bounds, "initial": initial, "outputs": outputs}
        _check_unused({**of_runs, "step": step, "t_start": t_start, **options})
        return identified_by_torque(model, entries, parameters, held, deviations, missing, share)
    for name in parameters:
        check_name("parameter", name, list(model.parameters), list(model.evaluator.fixed_parameters))
    runs = [measurements(model, entry, k, outputs, missing) for k, entry in enumerate(entries)]
    names = [run.name for run in runs]
    if (twice := next((name for name in names if names.count(name) > 1), None)) is not None:
        raise UsageError(Problem("data", f"two runs are named {twice} [E1089]", "files of different names"))
    size = model.description.simulation.step if step is None else number_of("step", step)
    begins = None if t_start is None else number_of("t_start", t_start)
    if not size > 0.0:
        raise UsageError(Problem("step", f"{size:.6g} s is not a step [E1081]", "a positive time"))
    p = model.evaluator.one_set({**held} or None, "one set of values")
    starts = _starts(initial, len(runs))
    for start_values in starts:
        _check_start(model, start_values, parameters, states)
    begun = [(start, initial_state(model, start, p, asked=True)) for start in starts]

    def at(h: float) -> ExperimentUnknowns:
        experiments = [
            Experiment(model, run, parameters, states, start, h, begins, options)
            for run, start in zip(runs, begun, strict=True)
        ]
        return ExperimentUnknowns(model, tuple(parameters), tuple(states), experiments, held)

    unknowns = at(size)
    if not unknowns.names:
        some = list(model.parameters)[:3]
        hint = (
            f"parameters={some!r} (--parameters {','.join(some)})" if some else 'states=["q.hinge"] (--states q.hinge)'
        )
        raise UsageError(Problem("parameters", "no parameter or state is named as unknown [E1082]", hint))
    x = unknowns.start
    limits, sigma = bounds_of(unknowns, bounds), deviations_of(unknowns.labels, deviations)
    predict = Predictions(unknowns.predict)
    check_effect(unknowns, predict, x, sigma)
    result = LeastSquares(predict, unknowns.data, unknowns.columns, limits, sigma).fit(x)
    return Judgement(unknowns, at(0.5 * size), result, predict, limits, sigma is not None, share).result()


def _check_start(
    model: Model, initial: Mapping[str, Any] | None, parameters: Sequence[str], states: Sequence[str]
) -> None:
    """Raise UsageError if initial components (`states`) are unknown although the initial state follows from elsewhere.
    That is the case for a start at equilibrium, and for a state that depends on unknown parameters."""
    if not states:
        return
    if not initial and model.library.layout["defaults"]["start"] == "equilibrium":
        fault = f"the scene starts at static equilibrium, and {states[0]} cannot be unknown as well [E1084]"
        raise UsageError(Problem("states", fault, "initial=model.equilibrium().initial, or no states"))
    if parameters and model.initial_at is not None and not {"q", "v"} <= set(initial or {}):
        fault = f"the scene's initial state follows from parameters, and {states[0]} cannot be unknown as well [E1085]"
        raise UsageError(Problem("states", fault, 'initial={"q": ..., "v": ...}, or no states'))


def _several(data: Data | Sequence[Data]) -> list[Data]:
    """Return the measured runs. Raises UsageError if there is none."""
    several = isinstance(data, list | tuple)
    runs: list[Data] = list(data) if several else [data]  # type: ignore[arg-type, list-item]  # a single one is checked
    if not runs:
        raise UsageError(Problem("data", "there are no measured runs [E1086]", '"run.csv"'))
    return runs


def _check_unused(options: Mapping[str, object]) -> None:
    """Raise UsageError for options of runs, if no run is made."""
    named = [name for name, value in options.items() if value is not None]
    if named:
        raise UsageError(
            Problem(named[0], "by torque no run is made that it could belong to [E1087]", 'by="run", or without it')
        )


def _check_lists(**lists: object) -> None:
    for name, entries in lists.items():
        names = names_of(name, name, entries, "mass" if name == "parameters" else "q.hinge")
        if len(set(names)) < len(names):
            raise UsageError(Problem(name, "a name is given twice [E0589]", "each of them once"))


def _parameter_values(model: Model, values: Mapping[str, Any] | None) -> dict[str, float]:
    """Return the given values of tunable parameters by name in SI units, with texts such as ``"2 kN/m"`` converted.
    Raises UsageError for an unknown name or another type."""
    if not (values is None or isinstance(values, Mapping)):
        fault = f"values by name are needed, not {shown(values)} [E1036]"
        raise UsageError(Problem("values", fault, 'values={"mass": 1.5}'))
    p = model.evaluator.one_set(values, "one set of values")
    names = list(model.parameters)
    return {name: float(p[names.index(name)]) for name in values or ()}


def _share(confidence: float) -> float:
    if not 0.0 < number_of("confidence", confidence, "probability") < 1.0:
        raise UsageError(Problem("confidence", f"{confidence!r} is not a probability [E1088]", "confidence=0.95"))
    return float(confidence)


def _starts(
    initial: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None, count: int
) -> list[Mapping[str, Any] | None]:
    if initial is None or isinstance(initial, Mapping):
        return [initial] * count
    if (
        isinstance(initial, str)
        or not isinstance(initial, Sequence)
        or any(isinstance(state, str) for state in initial)
    ):
        fault = f"a mapping is needed, or a list of them, not {shown(initial)} [E1090]"
        hint = 'initial={"hinge": 0.3}, or states=["q.hinge"] for components that are unknown'
        raise UsageError(Problem("initial", fault, hint))
    if len(initial) != count:
        fault = f"there are {len(initial)} initial states for {count} runs [E1092]"
        raise UsageError(Problem("initial", fault, "one for all, or one for each"))
    return list(initial)
