"""Sensitivities: a run with derivatives, and the options of ``simulate``. Scenes and methods without derivatives,
unknown names, and parameters that move the time of a jump are refused."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import count_of
from eomgen.base.calls import checked_call, names_of
from eomgen.compiled.arguments import check_name, number_of
from eomgen.compiled.initial_state import InitialState, check_initial, initial_state, starts_of, values_by_joint
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import comparisons, symbols
from eomgen.formula.nodes import Formula
from eomgen.integrators.families.family import LinearStep, LinearTransitions
from eomgen.integrators.families.register import Method, method_named
from eomgen.products.derivatives.alpha_run import AlphaRun
from eomgen.products.derivatives.crossings import check_crossings
from eomgen.products.derivatives.functionals import consecutive
from eomgen.products.derivatives.jump_motion import JumpMotion, acting_events
from eomgen.products.derivatives.jump_run import JumpRun
from eomgen.products.derivatives.linear_run import DerivativeVariables, LinearRun, Start
from eomgen.products.derivatives.motion import ReplayedRun
from eomgen.products.derivatives.partitioned_steps import PartitionedMotion
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.products.derivatives.transition_run import TransitionRun
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.request import read_request
from eomgen.simulation.stepping.inputs import Signal
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import ChosenStepper, chosen_stepper
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import TimeGrid, time_grid

#: Names of samples of inputs: the values of an input at all rows together, the value at one row, or each value
#: separately.
_INPUTS, _SAMPLE = "inputs.", re.compile(r"inputs\.(?P<name>[^\[]+)(?:\[(?P<row>\d+|:)\])?")
#: Tolerances of Newton's iterations for derivatives that are to be better than runs; of steps of generalized-alpha, and
#: of RATTLie.
_TIGHT = {"rtol": 1e-13, "atol": 1e-15}
_TIGHT_MEAN = {"rtol": 1e-14}
#: Advice on methods.
_OF_ALPHA = "generalized_alpha, hht, wbz, newmark or trapezoidal"
_WITH_DERIVATIVES = f"one of {_OF_ALPHA}; rattlie, rk4, rk4_partitioned"


def newton_settings(model: CompiledModel, method: str | None) -> dict[str, float]:
    """Return settings by which errors of Newton's iteration in a method's steps do not count in derivatives; none
    for methods without it. Raises UsageError for a method that there is not, and for the choice of one."""
    if method == "auto":
        fault = "auto chooses a method for each run, and not all of them have derivatives [E0615]"
        raise UsageError(Problem("method", fault, _WITH_DERIVATIVES))
    name = model.library.layout["built_method"] if method is None else method
    step = method_named(name).linear_step
    if isinstance(step, LinearTransitions):
        return {} if step.b else dict(_TIGHT_MEAN)
    return dict(_TIGHT) if isinstance(step, LinearStep) else {}


@checked_call(**KNOWN_ELSEWHERE, wrt="by", outputs="of")
def sensitivities(
    model: CompiledModel,
    t_end: float | None = None,
    step: float | None = None,
    *,
    by: Sequence[str] | None = None,
    of: Sequence[str] | None = None,
    method: str | None = None,
    rho_inf: float | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    gamma: float | None = None,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal] | None = None,
    record_every: int | None = None,
    t_start: float = 0.0,
    settings: Mapping[str, float] | None = None,
) -> Sensitivities:
    """Return derivatives of a run's outputs in parameters and the initial state, exact for the discrete steps.

    The run is the run of ``simulate`` with the same options. Residuals of Newton's iteration are in the derivatives,
    too: ``settings={"rtol": 1e-16, "atol": 1e-18}`` for derivatives to rounding.

    Parameters
    ----------
    t_end, step : float, optional
        As of ``simulate``; whole steps.
    by : sequence of str
        Tunable parameters, by default all; ``q.hinge``, ``v.hinge`` and internal states, ``z.filtered``, of the initial
        state. ``q.ball[0]`` of a rotating joint is a rotation about the joint's x axis, rad. The way to the initial
        state is in the derivatives: static equilibrium of the scene's start, steps onto constraints.
    of : sequence of str
        Outputs; all by default.
    method : str
        ``generalized_alpha``, ``hht``, ``wbz``, ``newmark``, ``trapezoidal``, also in index 3 with
        ``settings={"perturb": 0}``; ``rattlie``; ``rk4`` or ``rk4_partitioned``; ``auto``, the choice of ``simulate``.
    rho_inf, alpha, beta, gamma : float, optional
        As of ``simulate``.
    initial, parameters, inputs : mapping, optional
        As of ``simulate``.
    record_every : int, optional
        As of ``simulate``.
    t_start : float, optional
        As of ``simulate``.
    settings : mapping, optional
        As of ``simulate``.

    Returns
    -------
    Sensitivities
        ``derivatives`` of outputs over time, by tangents; ``gradient`` of a number of the whole run, by adjoints, and
        the ``hessian`` of this number.

    Raises
    ------
    UsageError
        Names that are none, a parameter that is fixed, a method without derivatives, quanta and functions of sampled
        states, jumps of forces within the run.
    NumericalError
        The run fails, the linearised equations have no solution, or the motion grazes at an event.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
    >>> result.derivatives["energy"].shape
    (101, 1)
    """
    request = read_request(model, step, t_start, parameters, initial)
    defaults = model.library.layout["defaults"]
    end = number_of("t_end", request.t + defaults["duration"] if t_end is None else t_end)
    every = count_of("record_every", defaults["record_every"] if record_every is None else record_every)
    options = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": None, "tolerance": None}
    name, _ = request.method(method, options)
    chosen = chosen_stepper(model, name, options, None)
    linear_step = _linear_step(model, chosen.name, chosen.method)
    if settings is not None:  # which a method without derivatives need not know
        chosen = chosen_stepper(model, name, options, settings)
    outputs = _outputs(model, of)
    grid = time_grid(request.t, end, request.step, chosen.library.real)
    _check(model, chosen, grid, initial)
    if grid.whole % every:
        divides = max(part for part in range(1, every + 1) if grid.whole % part == 0)
        fault = f"{grid.whole} steps are not a whole number of rows of {every} steps: the end has no row [E0587]"
        raise UsageError(Problem("record_every", fault, f"record_every = {divides}"))
    run = request.run(chosen, grid, every, inputs)
    signals = run.signals.given
    names, directions = _directions(model, by, signals, grid.whole)
    parameter_names = [list(model.parameters)[column] for column in directions.columns["p"]]
    _check_formulas(model, signals, parameter_names)
    chosen.check_span(run, changed=request.changed)
    state, _, _ = request.initial_state(run)
    start = _start(run, initial, state, parameter_names, at_rest=request.at_rest)
    rows = [row for places in outputs.values() for row in places]
    stepper = Stepper(chosen.library, run.settings, run.parameters)
    jumps = stepper.layout["sampled"] or any(acting_events(stepper.layout))
    motion: type[ReplayedRun] = ReplayedRun
    linear_run: Callable[..., LinearRun[Any]] = TransitionRun
    if isinstance(linear_step, LinearStep):
        of_step = 48 * (model.nv + model.nz) * (model.nv + model.nz + len(model.multipliers))
        motion, linear_run = (JumpMotion, JumpRun) if jumps else (ReplayedRun, AlphaRun)
    else:
        of_step = 32 * (2 * (model.nv + len(model.multipliers)) + model.nz) ** 2
        motion = PartitionedMotion if linear_step.b and model.multipliers else ReplayedRun
    linear = linear_run(motion(run, stepper, state, of_step), start, directions, rows)
    check_crossings(linear, names)
    return Sensitivities(linear, names, outputs)


def _start(
    run: Run, initial: Mapping[str, Any] | None, state: InitialState, by: Sequence[str], *, at_rest: bool
) -> Start:
    """Return the dependence of a run's initial state on the parameters ``by``. `initial` is the caller's, `state` the
    state with which the run begins, at static equilibrium if `at_rest`. Raises UsageError if derivatives of the initial
    state in the parameters are not known."""
    model, p = run.model, run.parameters
    asked = initial_state(model, initial, p, asked=not at_rest)
    if at_rest:
        asked = InitialState(state.q, asked.v, state.z)
    if model.initial_at is None or not by or {"q", "v"} <= set(initial or {}) or (at_rest and not np.any(asked.v)):
        return Start(asked, at_rest)
    parameters = dict(zip(model.parameters, p.tolist(), strict=True))
    slopes = getattr(model.initial_at, "slopes", lambda *_: None)(parameters, by)
    if slopes is None:
        fault = "the scene's initial state follows from parameters, and that is not in the derivatives [E0588]"
        raise UsageError(Problem("initial", fault, 'initial={"q": ..., "v": ...}, for a start that is held'))
    if at_rest:
        return Start(asked, at_rest, slopes)
    for name, value in values_by_joint(model, initial).items():
        factor = next((factor for factor in model.factors if factor.name == name), None)
        parts = set(value) if isinstance(value, Mapping) else {"position"}
        for block, part, slope in (("q", "position", slopes[0]), ("v", "velocity", slopes[1])):
            if name == block:
                slope[:] = 0.0
            elif factor is not None and part in parts:
                slope[factor.v] = 0.0
    return Start(asked, slopes=slopes)


def _directions(
    model: CompiledModel, by: Sequence[str] | None, inputs: Collection[str], steps: int
) -> tuple[tuple[str, ...], DerivativeVariables]:
    """Return the names of the variables of derivatives, and their columns: parameters, then q, v, z, then samples of
    inputs. ``inputs`` are names of inputs that the caller gives, `steps` the number of steps. Raises UsageError for
    unknown or repeated names."""
    parameters, states = list(model.parameters), list(model.z_names)
    rates = list(model.v_names)
    places = [f"q{name[1:]}" for name in rates]
    every = _names(by, parameters, places, rates)
    samples = _samples(model, [name for name in every if str(name).startswith(_INPUTS)], inputs, steps)
    chosen = [name for name in every if not str(name).startswith(_INPUTS)]
    known = {"p": parameters, "q": places, "v": rates, "z": states}
    for name in chosen:
        if not any(name in names for names in known.values()):
            of_state = str(name).startswith(("q.", "v.", "z."))
            fault = "component of the initial state" if of_state else "parameter"
            fixed = list(model.evaluator.fixed_parameters)
            check_name(fault, name, [*places, *rates, *states] if of_state else parameters, fixed)
    columns = {block: [names.index(name) for name in chosen if name in names] for block, names in known.items()}
    ordered = [known[block][column] for block in "pqvz" for column in columns[block]]
    if len(set(ordered)) < len(chosen) or len(set(samples)) < len(samples):
        raise UsageError(Problem("by", "a name is given twice [E0589]", "each of them once"))
    return (*ordered, *(name for name, _ in samples)), DerivativeVariables(columns, [column for _, column in samples])


def _names(
    by: Sequence[str] | None, parameters: Sequence[str], places: Sequence[str], rates: Sequence[str]
) -> list[str]:
    """Return the names of the variables of derivatives, all tunable parameters by default. Raises UsageError if there
    are none."""
    names = list(parameters if by is None else names_of("by", "directions", by, ([*parameters, *places])[0]))
    if not names:
        fault = "the scene has no tunable parameters [E0593]"
        if by is not None:
            fault = "no quantity is named to differentiate by [E0592]"
        hint = f'by=["{places[0]}"]' if parameters else f'by=["{places[0]}", "{rates[0]}"], of the initial state'
        raise UsageError(Problem("by", fault, hint))
    return names


def _samples(
    model: CompiledModel, names: Sequence[str], inputs: Collection[str], steps: int
) -> list[tuple[str, tuple[int, int]]]:
    """Return for names such as ``inputs.push[3]`` the name with the (column, row) of the input's sample. The row is -1
    for a common change at all rows; ``[:]`` gives one name for each row. Raises UsageError for an unknown input, an
    input by a formula, or a row beyond the run."""
    known = [item.name for item in model.description.inputs]
    result = []
    for name in names:
        match = _SAMPLE.fullmatch(name)
        if match is None or not known:
            fault = f"{name!r} is not a sample of an input [E0594]" if known else "the scene has no inputs [E0595]"
            hint = ", ".join(f"inputs.{known[0]}{part}" for part in ("", "[3]", "[:]")) if known else "parameters"
            raise UsageError(Problem("by", fault, hint))
        check_name("input", match["name"], known)
        column, row = known.index(match["name"]), match["row"]
        if model.description.inputs[column].given and match["name"] not in inputs:
            fault = f"the input {match['name']} follows a formula of the scene [E0596]"
            raise UsageError(Problem("by", fault, f'inputs={{"{match["name"]}": ...}}, to give values'))
        if row is not None and row != ":" and int(row) > steps:
            fault = f"the run has rows 0 to {steps}, and {name} is none of them [E0597]"
            raise UsageError(Problem("by", fault, f"inputs.{match['name']}[{steps}]"))
        rows = [-1] if row is None else range(steps + 1) if row == ":" else [int(row)]
        result += [(name if row < 0 else f"inputs.{match['name']}[{row}]", (column, row)) for row in rows]
    return result


def _outputs(model: CompiledModel, of: Sequence[str] | None) -> dict[str, list[int]]:
    """Return the numbers of the components of chosen outputs among all components, by name; all outputs by default.
    Raises UsageError for an unknown output, or if there are none."""
    places = consecutive({str(item["name"]): int(item["size"]) for item in model.library.layout["outputs"]})
    names = list(places) if of is None else names_of("of", "outputs", of, "angle")
    for name in names:
        check_name("output", name, list(places))
    if not places:
        fault = "the scene has no outputs to differentiate [E0600]"
        raise UsageError(Problem("of", fault, '[outputs.angle] formula = "q.hinge" in the scene'))
    if not names:
        raise UsageError(Problem("of", "the list of outputs is empty [E1431]", f'of=["{next(iter(places))}"]'))
    return {name: places[name] for name in names}


def _check(model: CompiledModel, chosen: ChosenStepper, grid: TimeGrid, initial: Mapping[str, Any] | None) -> None:
    """Raise UsageError for a run that has no derivatives: held corrections, multipliers at rows, jumps, cut steps,
    floats."""
    check_initial(initial)
    layout = chosen.library.layout
    if held := [start.joint for start in starts_of(model, initial) if start.held]:
        fault = f"the start holds {', '.join(held)}, and such corrections have no derivatives here [E2216]"
        raise UsageError(Problem("initial", fault, "consistent values without hold"))
    _check_jumps(layout, chosen.method)
    if _in_index_3(layout, chosen.method) and chosen.settings.get("perturb", 1.0):
        fault = f"{chosen.name} starts with velocities off the constraints, which have no derivatives here [E0601]"
        raise UsageError(Problem("settings", fault, 'settings={"perturb": 0}, for a start with the given velocities'))
    if chosen.settings.get("multipliers", 0.0):
        fault = "multipliers before or after each row belong to two steps, and have no derivatives here [E0602]"
        raise UsageError(Problem("settings", fault, 'settings={"multipliers": 0}, for the ones of accelerations'))
    if layout["method"].get("jumps") and len(model.discontinuity_times(grid.start, grid.reached)):
        first = float(model.discontinuity_times(grid.start, grid.reached)[0])
        fault = f"forces jump at t = {first:.6g} s, and steps cut in two there have no derivatives here [E0603]"
        raise UsageError(Problem("sensitivities", fault, "a smooth law in its place"))
    if not grid.whole:
        fault = f"the run from {grid.start:.6g} s to {grid.end:.6g} s has no whole step of {grid.step:.6g} s [E0604]"
        swapped = grid.start < grid.step and grid.end > grid.start
        hint = f"t_end = {grid.step:.6g}, step = {grid.end:.6g}: the end comes first" if swapped else "a later t_end"
        raise UsageError(Problem("t_end", fault, hint))
    if grid.rest:
        fault = f"the last step is shorter than {grid.step:.6g} s, and has no derivatives here [E0605]"
        raise UsageError(Problem("t_end", fault, f"t_end = {grid.start + grid.whole * grid.step:.9g}"))
    if chosen.library.real != "double":
        fault = f"the model computes with {chosen.library.real}, whose rounding derivatives would be lost in [E0606]"
        raise UsageError(Problem("sensitivities", fault, 'real = "double"'))


def _in_index_3(layout: Mapping[str, Any], method: Method) -> bool:
    """Return whether steps hold constraints on positions alone."""
    return bool(layout["sizes"]["holonomic"]) and getattr(method, "form", "") == "index3"


def _check_jumps(layout: Mapping[str, Any], method: Method) -> None:
    """Raise UsageError for samples and acting events without derivatives: other methods, functions or quanta of sampled
    states."""
    jumps = "events" if any(acting_events(layout)) else "sampled states" if layout["sampled"] else ""
    if jumps and (_in_index_3(layout, method) or not isinstance(method.linear_step, LinearStep)):
        fault = f"the scene has {jumps}, across which this method has no derivatives [E0607]"
        raise UsageError(Problem("method", fault, _OF_ALPHA))
    states = layout["states"]
    for row in layout["sampled"]:
        name = states[int(row["state"])]["name"]
        if int(row["controller"]) >= 0:
            fault = f"a function of a controller sets the sampled state {name}, and its slopes are not known [E0608]"
            raise UsageError(Problem("sensitivities", fault, "sampled states with formulas in place of the function"))
        if row["quantum"]:
            fault = f"the sampled state {name} is rounded: its derivatives are 0 or infinite [E0609]"
            hint = "the scene without this quantum, for the derivatives of its mean"
            raise UsageError(Problem("sensitivities", fault, hint))


def _check_formulas(model: CompiledModel, inputs: Collection[str], by: Sequence[str]) -> None:
    """Raise UsageError for an input given by the caller whose formula in the scene contains a parameter of ``by``:
    partials would belong to the formula, which the run does not use. Also for a comparison of time with such a
    parameter: the instant at which a formula takes another branch moves with it, which no partial derivative shows."""

    def parameter_in(formula: Formula) -> str:
        names = (symbol.name for symbol in symbols(formula) if symbol.kind == "parameter")
        return next((name for name in names if name in by), "")

    followed = list(model.description.formulas)
    prescribed = {item.name: item.formula for item in model.description.inputs if item.formula is not None}
    for input_name, formula in prescribed.items():
        if input_name not in inputs:
            followed.append(formula)
        elif name := parameter_in(formula):
            fault = f"the input {input_name} is given, but derivatives by {name} belong to its formula [E0613]"
            raise UsageError(Problem("inputs", fault, f"by=... without {name}, or {input_name} by its formula"))
    for condition in (condition for formula in followed for condition in comparisons(formula)):
        name = parameter_in(condition)
        if name and any(symbol.kind == "time" for symbol in symbols(condition)):
            fault = f"{name} moves the instant at which a formula takes another branch, without derivatives [E0614]"
            raise UsageError(Problem("by", fault, "a smooth law in its place, max(t - start, 0) for a ramp"))


def _linear_step(model: CompiledModel, name: str, method: Method) -> LinearStep | LinearTransitions:
    """Return the coefficients of a method's steps made linear. Raises UsageError for a method without linearised
    steps, for such a scene."""
    internal = model.nz > len(model.library.layout["sampled"])
    if method.chooses_steps:
        fault = f"{name} chooses its steps, and their ends move with the parameters of the derivatives [E0616]"
        raise UsageError(Problem("method", fault, _WITH_DERIVATIVES))
    step = method.linear_step
    if step is None:
        raise UsageError(Problem("method", f"{name} has no derivatives of runs here [E0620]", _WITH_DERIVATIVES))
    if internal and isinstance(step, LinearStep) and (step.alpha_m, step.rate_alpha_m) != (step.alpha_f, step.alpha_f):
        fault = f"{name} starts internal states with rates of their rates, which have no derivatives here [E0619]"
        raise UsageError(Problem("method", fault, "trapezoidal or newmark"))
    return step
