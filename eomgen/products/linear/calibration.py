"""Gains of state feedback from the linear model of the same scene, with these gains at zero (calibration), and messages
about the closed loop: its slowest motion, and modes that miss the requested poles.

The scene is opened at a controller: its output becomes an input in addition to its formula. The linear model of that
scene is the plant, signals and weighted quantities are its outputs. Controllers are calibrated in order, each
with earlier ones active. Gains are parameters, so the code of a model depends on their defaults only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.errors import DescriptionError, EomgenError, Message, ModelError, Problem, UsageError
from eomgen.formula.nodes import Symbol
from eomgen.pipeline.front_end import Preparation
from eomgen.products.linear.control import weights as costs
from eomgen.products.linear.control.regulator import lqr, place
from eomgen.products.linear.control.second_order import (
    ModalFeedback,
    Plant,
    modal_feedback,
    modes_of,
    optimal_modal_gains,
    placed_modal_gains,
)
from eomgen.products.linear.control.weights import Weights
from eomgen.products.linear.eigenvalues import balance
from eomgen.products.linear.modes import modes
from eomgen.scene.control.model import Calibration, StateFeedback
from eomgen.scene.scene import Scene
from eomgen.system.signals import Input, Output
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.products.linear.linearization import Linearization
    from eomgen.products.linear.state_space import StateSpace


def slowest_motion(A: Array, names: Sequence[str], inertias: Array) -> str:
    """Return a sentence with the decay rate (1/s) of the slowest motion of a closed loop, or a motion without decay.
    `A` (ns, ns) is the matrix of the closed loop, whose first states are the coordinates `names` with `inertias`."""
    result = modes(A, np.eye(len(names), len(A)), names, inertias)
    slowest = int(np.argmax(result.eigenvalues.real))
    rate, mover = -float(result.eigenvalues[slowest].real), result.dominant(slowest, 1)[0][0]
    if abs(rate) <= result.uncertainty[slowest]:
        return f"the closed loop does not decay: {mover}"
    if rate < 0.0:
        return f"the closed loop grows at {-rate:.4g} 1/s: {mover}"
    return f"the slowest motion of the closed loop decays at {rate:.4g} 1/s"


def check_reach(name: str, plant: Plant, modal: ModalFeedback) -> None:
    """Raise ModelError if the outputs of the controller `name` cannot actuate the controlled modes independently."""
    if modal.crosstalk <= WRITTEN:
        return
    numbers = ", ".join(str(k + 1) for k in modal.controlled)
    ways = int(np.linalg.matrix_rank(modal.modes.shapes[:, list(modal.controlled)].T @ plant.B, rtol=COMPUTED))
    only = f"{name} acts on them in {ways} independent way{'s' * (ways > 1)} only"
    fault = f"the modes {numbers} cannot be placed each by itself: {only} [E0517]"
    raise ModelError(fault, f"{ways} of the modes, an output more, all poles in place of modes, or lqr")


def not_reached(modal: ModalFeedback, wanted: ArrayLike, ratios: Array) -> str:
    """Return a text on the controlled modes that differ from the requested poles by more than 1e-3; empty if none does.
    `wanted` are the requested frequencies in rad/s and `ratios` the damping ratios, both (controlled modes,)."""
    differences = []
    for k, w, zeta in zip(modal.controlled, np.asarray(wanted), ratios, strict=True):
        pole = w * (-zeta + np.sqrt(complex(zeta**2 - 1.0)))
        nearest_pole = modal.eigenvalues[np.argmin(np.abs(modal.eigenvalues - pole))]
        if abs(nearest_pole - pole) > 1e-3 * w:
            got = f"{abs(nearest_pole):.4g} rad/s with a damping ratio of {-nearest_pole.real / abs(nearest_pole):.3g}"
            differences.append(f"mode {k + 1} gets {got}, not {w:.4g} with {zeta:.3g}")
    return f"damping couples the modes: {', '.join(differences)}; " if differences else ""


def calibrate(scene: Scene, build: Callable[[Scene, list[str]], Model]) -> Scene:
    """Return a scene whose gains have calibrated values as defaults, and a note on each controller.

    Parameters
    ----------
    build : callable
        Builds the model of a scene with the terms given.

    Raises
    ------
    DescriptionError, ModelError, NumericalError
        If a calibration fails; with the place in the scene file.
    """
    if not any(item.calibration for item in scene.feedback):
        return scene
    values, notes = gains(scene, {}, build)
    parameters = tuple(replace(item, value=values.get(item.name, item.value)) for item in scene.parameters)
    return replace(scene, parameters=parameters, notes=(*scene.notes, *map(Message, notes)))


def gains(
    scene: Scene, parameters: Mapping[str, float], build: Callable[[Scene, list[str]], Model]
) -> tuple[dict[str, float], list[str]]:
    """Return calibrated gains and references by name of parameter, and a note on each calibrated controller.
    `parameters` are values of tunable parameters that differ from the defaults; values of calibrated ones are ignored.
    `build` makes a model of a scene with some terms. Errors name the place of the calibration in the scene file."""
    opened = _open_loops(scene)
    model = build(opened.scene, [*PURPOSES["linearization"], "outputs"])
    # these are zero by default
    values = {name: value for name, value in parameters.items() if name not in opened.calibrated}
    notes = []
    for item in scene.feedback:
        if item.calibration is None:
            continue
        key = f"controllers.{item.name}.calibration"
        try:
            gains_of_one, note = _one(opened, item, item.calibration, model, values)
        except EomgenError as error:
            where = f"{scene.source.get(key, scene.name)} ({key})"
            # the requested result stands in the scene
            kind = DescriptionError if isinstance(error, UsageError) else type(error)
            raise kind([Problem(where, problem.what, problem.hint) for problem in error.problems]) from None
        values |= gains_of_one
        notes.append(note)
    return {name: values[name] for name in opened.calibrated}, notes


class _OpenLoopScene(NamedTuple):
    """A scene with inputs in addition to the outputs of controllers, the names of the parameters that calibrations
    fill, and for each output of the opened scene its rows among all rows."""

    scene: Scene
    calibrated: tuple[str, ...]
    rows: Mapping[str, slice]


def _open_loops(scene: Scene) -> _OpenLoopScene:
    """Return a scene in which calibrated state feedback has additional inputs and outputs for a linear model. An input
    is added to the formula of each output of the feedback, whose gains are zero; its signals, and the weighted joint
    coordinates and velocities, become outputs."""
    fed_back = [item for item in scene.feedback if item.calibration is not None]
    acting = [output for item in fed_back for output in item.outputs]
    controllers = tuple(
        replace(item, output=item.output + Symbol("input", _input_of(item.name))) if item.name in acting else item
        for item in scene.controllers
    )
    outputs = list(scene.outputs)
    for item in fed_back:
        outputs.append(Output(f"{item.name}.signals", item.signals))
        for kind, weights in _joint_weights(item.calibration) if item.calibration else ():
            outputs += [Output(f"{item.name}.{kind}.{joint}", (Symbol(kind, joint),)) for joint in weights]
    rows, start = {}, 0
    for output in outputs:
        rows[output.name] = slice(start, start + len(output.values))
        start += len(output.values)
    inputs = (*scene.inputs, *(Input(_input_of(name)) for name in acting))
    legal = tuple(replace(output, name=f"output_{number}") for number, output in enumerate(outputs))
    opened = replace(scene, controllers=controllers, inputs=inputs, outputs=legal, feedback=(), terms=(), notes=())
    return _OpenLoopScene(opened, tuple(name for item in fed_back for name in item.calibrated_parameters), rows)


def _joint_weights(calibration: Calibration) -> tuple[tuple[str, Mapping[str, float]], ...]:
    """Return the weights of joints by the letter of their quantity."""
    return ("q", calibration.position_weights), ("v", calibration.velocity_weights)


def _input_of(output: str) -> str:
    return f"opened_{output}"[:64]


def _one(
    opened: _OpenLoopScene, item: StateFeedback, calibration: Calibration, model: Model, values: Mapping[str, float]
) -> tuple[dict[str, float], str]:
    """Return the calibrated gains and references of the controller `item` by name of parameter, and a note on the
    result. `model` is the model of the opened scene, `values` are parameters that differ from the defaults, including
    gains of earlier controllers."""
    rest = model.equilibrium(parameters=values, any_kind=True) if calibration.at == "equilibrium" else None
    linear = model.linearize(at=rest or "initial", parameters=values)
    _check_balance(linear)
    names = [_input_of(output) for output in item.outputs]
    columns = [linear.names.inputs.index(name) for name in names]
    space = linear.state_space()
    kept = len(space.states) if np.any(linear.Z0) else 2 * len(linear.coordinates)  # states that act on the motion
    cut: dict[str, Any] = {"A": space.A[:kept, :kept], "B": space.B[:kept], "E": space.E[:kept], "C": space.C[:, :kept]}
    space = replace(space, **cut, states=space.states[:kept], units={}, references={})
    D = space.D[:, columns]
    if calibration.method == "lqr" or calibration.poles:
        G, description = _feedback_of_whole_state(space, names, opened, item, calibration), ""
    else:
        _check_second_order(linear)
        plant = Plant(linear.M0, linear.C0, linear.K0, linear.B0[:, columns], linear.coordinates)
        G, description = _modal_feedback(plant, item, calibration)
    description += slowest_motion(space.A - space.B[:, columns] @ G, linear.coordinates, np.diag(linear.M0))
    rows = opened.rows[f"{item.name}.signals"]
    of_signals = _by_signals(space, item, G, space.C[rows], D[rows])
    names_of_gains = [name for names_of_output in item.gains for name in names_of_output]
    result = {name: _round(value) for name, value in zip(names_of_gains, of_signals.ravel(), strict=True)}
    if any(item.references):
        there = linear.reference
        base = None if rest is None else rest.base
        options: dict[str, Any] = {"z": there.z, "parameters": values, "base": base}
        (outputs,) = model.evaluate("outputs", there.q, there.v, there.a, there.t, there.u, **options).values()
        signals = outputs[rows]
        result |= {name: _round(value) for name, value in zip(item.references, signals, strict=True) if name}
    cautions = [] if rest is None else rest.warnings(any_kind=True)
    summary = f"controllers.{item.name}: gains by {calibration.method} about the {linear.reference.what}; {description}"
    return result, "; ".join((summary, *cautions))


def _feedback_of_whole_state(
    space: StateSpace, names: Sequence[str], opened: _OpenLoopScene, item: StateFeedback, calibration: Calibration
) -> Array:
    """Return the gains of coordinates, velocities and internal states, (m, ns), by pole placement if the calibration
    has poles, else by LQR with its quadratic costs of joint coordinates, velocities, signals and outputs, each a row of
    the outputs. `names` are the m inputs that the controller drives."""
    if calibration.poles:
        return place(space, calibration.poles, inputs=names).gains
    ns, m = len(space.states), len(names)
    effort = costs.weight("the weight of the efforts", _each(calibration.effort_weights or (0.0,), m), m)
    weights = Weights(np.zeros((ns, ns)), effort, np.zeros((ns, m)))
    weighted: list[tuple[int, float]] = []
    for kind, table in _joint_weights(calibration):
        weighted += [(opened.rows[f"{item.name}.{kind}.{joint}"].start, weight) for joint, weight in table.items()]
    first = opened.rows[f"{item.name}.signals"].start
    weighted += [(first + item.labels.index(name), weight) for name, weight in calibration.signal_weights.items()]
    for name, weight in calibration.output_weights.items():
        rows = opened.rows[name]
        weighted += [(row, weight) for row in range(rows.start, rows.stop)]
    if weighted:
        kept, cost = (list(column) for column in zip(*weighted, strict=True))
        columns = [space.inputs.index(name) for name in names]
        weights = weights.plus_output(space.C[kept], space.D[np.ix_(kept, columns)], cost)
    return lqr(space, weights.state, weights.effort, weights.cross, inputs=names).gains


def _check_balance(linear: Linearization) -> None:
    """Raise ModelError if the linear model is not about a balance."""
    acceleration = float(np.abs(linear.reference.a).max())
    if acceleration > WRITTEN:
        fault = f"the initial state is not in balance: it accelerates with {acceleration:.3g} m/s^2 or rad/s^2 [E0518]"
        raise ModelError(fault, 'at = "equilibrium", or an initial state of rest or of steady motion')


def _check_second_order(linear: Linearization) -> None:
    """Raise ModelError if the linear model is none of second order."""
    if np.any(linear.Z0):
        where = ", ".join(name for name, column in zip(linear.names.states, linear.Z0.T, strict=True) if np.any(column))
        fault = f"forces depend on the internal states {where}, and modes belong to models of second order [E0519]"
        raise ModelError(fault, "lqr, or all poles; a controller without memory between, or gains of your own")


def _modal_feedback(plant: Plant, item: StateFeedback, calibration: Calibration) -> tuple[Array, str]:
    """Return the gains of the state [q, v], (m, 2n), by single modes with optimal or placed gains, and the beginning of
    a description. Raises ModelError if modes cannot be placed independently."""
    modes = modes_of(plant)
    chosen = [number - 1 for number in calibration.modes] or list(range(min(plant.B.shape)))
    known = [k for k in chosen if k < len(plant.M)]
    w, c = modes.frequencies[known], modes.damping[known]
    if calibration.method == "imsc":
        g, h = optimal_modal_gains(w, c, _each(calibration.effort_weights, len(known)))
    else:
        wanted, ratios = calibration.frequencies[: len(known)] or w, _each(calibration.damping_ratios, len(known))
        g, h = placed_modal_gains(w, c, wanted, ratios)
    modal = modal_feedback(plant, modes, chosen, _each(tuple(g), len(chosen)), _each(tuple(h), len(chosen)))
    description = f"modes {', '.join(str(k + 1) for k in modal.controlled)}, spillover {modal.spillover:.2g}"
    description += f", crosstalk {modal.crosstalk:.2g}" if modal.crosstalk else ""
    missed = ""
    if calibration.method == "pole_placement":
        check_reach(item.name, plant, modal)
        missed = not_reached(modal, wanted, ratios)
    return np.hstack([modal.G_p, modal.G_v]), f"{description}; {missed}"


def _each(numbers: Sequence[float], count: int) -> Array:
    """Return an array of `count` numbers: the numbers, or a single number repeated."""
    return np.resize(np.array(numbers, dtype=float), count) if len(numbers) != count else np.array(numbers, dtype=float)


def _by_signals(space: StateSpace, item: StateFeedback, G: Array, Y: Array, Y_u: Array) -> Array:
    """Return gains of the signals, (m, signals), that give the same feedback as the gains G of the model's state.

    `G` is (m, ns); `Y` (signals, ns) and `Y_u` (signals, m) give the signals by state and by controller output.

    Raises
    ------
    ModelError
        Signals that do not determine all of the fed-back state, or that depend on the controller's output.
    """
    if np.any(Y_u):
        signal = item.labels[int(np.argwhere(np.any(Y_u, axis=1))[0, 0])]
        fault = f"the signal {signal} depends on the controller's output at the same instant [E0520]"
        raise ModelError(fault, "another signal")
    scales = np.diag(balance(space.A, permute=False)[1])
    scaled, wanted = Y * scales, G * scales
    sizes = np.linalg.norm(scaled, axis=1)
    sizes[sizes == 0.0] = 1.0
    scaled = scaled / sizes[:, np.newaxis]
    result = wanted @ np.linalg.pinv(scaled, rcond=1e-10)
    left, scale = wanted - result @ scaled, np.abs(G).max(axis=0)
    if np.linalg.norm(left) > 1e-8 * float(np.linalg.norm(wanted)):
        share = np.abs(left / scales).max(axis=0) / np.where(scale > 0.0, scale, 1.0)
        name = space.states[int(np.argmax(share))]
        missing, of = name.removeprefix("z.") if "." in name else f"q.{name}", item.name
        fault = f"the feedback needs {missing}, which the coordinates and signals of {of} do not determine [E0521]"
        raise ModelError(fault, f"{missing} among its signals, or its joint among its coordinates")
    result[np.abs(result) < 1e-13 * np.abs(result).max()] = 0.0
    return np.asarray(result / sizes)


def _round(value: float) -> float:
    return float(f"{value:.12g}") + 0.0  # further digits depend on the machine


CALIBRATION = Preparation("calibration", calibrate, gains)
