"""Linear models with filters before them: another model's outputs drive a model, and its states join the model's own.

A coloured disturbance is the output of a shaping filter driven by white noise; one that is seen ahead is delayed before
it acts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import pade

from eomgen.base.arrays import Array, count_of
from eomgen.base.data import replace
from eomgen.base.messages import listed
from eomgen.compiled.arguments import number_of, numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.state_space import KINDS, HasStateSpace, StateSpace, signal_labels, state_space_of


def driven_by(space: StateSpace | HasStateSpace, source: StateSpace | HasStateSpace) -> StateSpace:
    """Return a model whose disturbances and inputs of some names are the outputs of these names of another model.

    Parameters
    ----------
    space : StateSpace or Linearization
        The driven model.
    source : StateSpace or Linearization
        A filter, a delay, an actuator. Inputs and disturbances of equal names in both models are one and the same, and
        act on both, but one with the name of a driven signal acts on the source alone. Units of the two models are not
        compared.

    Returns
    -------
    StateSpace
        States of the model, then of the source; the source's inputs and disturbances replace the driven signals, and a
        name that is an input of either model is an input. Outputs of the source with names that no output of the model
        has are also outputs of the whole, for weights and measurements.

    Raises
    ------
    UsageError
        No output of the source drives the model, models that are sampled differently, or states of equal names.

    Examples
    --------
    >>> from eomgen.control import delay, driven_by
    >>> car = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
    >>> late = driven_by(car, delay("front", "road", "0.1 s", order=2, unit="m"))
    >>> late.disturbances, len(late.states)
    (('front',), 6)
    """
    space, source = state_space_of(space), state_space_of(source)
    driven = _driven_signals(space, source)
    inputs = _unite([name for name in space.inputs if name not in driven], source.inputs)
    disturbances = _unite([name for name in space.disturbances if name not in driven], source.disturbances)
    disturbances = [name for name in disturbances if name not in inputs]
    left = (*inputs, *disturbances)
    new = [k for k, name in enumerate(source.outputs) if name not in space.outputs]
    outputs = [source.outputs[k] for k in new]
    rows = [source.outputs.index(name) for name in driven]
    into_states, into_outputs = _entering(space, driven)
    direct = [name * (name not in driven) for name in left]
    (B, D), (of_source, seen) = _entering(space, direct), _entering(source, left)
    A = np.block([[space.A, into_states @ source.C[rows]], [np.zeros((len(source.A), len(space.A))), source.A]])
    G = np.vstack([B + into_states @ seen[rows], of_source])
    C = np.block([[space.C, into_outputs @ source.C[rows]], [np.zeros((len(new), len(space.A))), source.C[new]]])
    H = np.vstack([D + into_outputs @ seen[rows], seen[new]])
    names = ((*space.states, *source.states), tuple(inputs), tuple(disturbances), (*space.outputs, *outputs))
    nu = len(inputs)
    matrices = (A, G[:, :nu], G[:, nu:], C, H[:, :nu], H[:, nu:])
    signals = {kind: _labels(kind, wanted, (space, source), driven) for kind, wanted in zip(KINDS, names, strict=True)}
    of = {name: getattr(space, name) for name in ("sample", "input_delay", "waiting", "orientations")}
    return StateSpace(*matrices, *names, **signal_labels(signals), **of)


def _driven_signals(space: StateSpace, source: StateSpace) -> list[str]:
    """Return the names of the source's outputs that are inputs or disturbances of the model `space`. Raises UsageError
    if there are none, the models are sampled differently, or they have states of equal names."""
    if space.sample != source.sample:
        fault = f"one model is {_how(space)} and the other is {_how(source)} [E0366]"
        raise UsageError(Problem("driven_by", fault, "both in continuous time, or both with the same sample"))
    columns = (*space.inputs, *space.disturbances)
    driven = [name for name in source.outputs if name in columns]
    if not driven:
        fault = f"none of {listed(source.outputs)} is an input or a disturbance of the model [E0367]"
        raise UsageError(Problem("driven_by", fault, f"outputs called {' or '.join(columns[:4])}"))
    again = [name for name in source.states if name in space.states]
    if again:
        fault = f"both models have a state {listed(again)} [E0368]"
        raise UsageError(Problem("driven_by", fault, "other names in one of them"))
    return driven


def shaping_filter(
    numerator: ArrayLike, denominator: ArrayLike, input: str, output: str, unit: str = "", states: str = ""
) -> StateSpace:
    """Return the filter output = numerator(s)/denominator(s) input, as a model that can drive another model.

    Parameters
    ----------
    numerator, denominator : array_like
        Coefficients, highest power of s first; the numerator of no higher degree.
    input : str
        Name of the filter's only disturbance, such as white noise; the filter has no inputs.
    output : str
        Name of the driven signal.
    unit : str, optional
        Unit of the output.
    states : str, optional
        NAME in the names of several states, ``filter.NAME[0]``, or of a single state, ``filter.NAME``; the output's
        name by default.

    Returns
    -------
    StateSpace
        Continuous, with as many states as the degree of the denominator.

    Raises
    ------
    UsageError
        Coefficients that are not finite, a denominator of zeros, or a numerator of higher degree.

    Examples
    --------
    >>> from eomgen.control import root_mean_squares, shaping_filter
    >>> gusts = shaping_filter([1.0], [1.0, 0.5], "white", "wind", "N")
    >>> round(root_mean_squares(gusts, {"white": 0.1})["wind"], 6)     # sqrt(0.1 / (2 0.5))
    0.316228
    """
    top, bottom = (
        np.trim_zeros(np.atleast_1d(numbers(name, item)), "f")
        for name, item in (("numerator", numerator), ("denominator", denominator))
    )
    if not len(bottom) or not np.all(np.isfinite(bottom)) or not np.all(np.isfinite(top)) or top.ndim != 1:
        fault = "the coefficients are not finite numbers [E0369]"
        raise UsageError(Problem("shaping_filter", fault, "[2.0], [1.0, 0.5]"))
    if len(top) > len(bottom):
        fault = f"the numerator has the degree {len(top) - 1} and the denominator {len(bottom) - 1} [E0370]"
        raise UsageError(Problem("shaping_filter", fault, "a denominator of that degree: a filter that can be built"))
    A, B, C, D = _states_of(top if len(top) else np.zeros(1), bottom)
    n = len(bottom) - 1  # scipy gives a constant a state
    return _filter(A[:n, :n], B[:n], C[:, :n], D, input, output, unit, states or output)


def delay(input: str, output: str, time: float | str, order: int = 4, unit: str = "") -> StateSpace:
    """Return a pure delay as a model that can drive another model, approximated by Padé in continuous time.

    The rear axle drives over the road passed by the front axle; a sensor ahead of the vehicle sees the road ahead.

    Parameters
    ----------
    input, output : str
        Names of the undelayed signal, the only disturbance of the result, and of the delayed signal, the only output.
    time : float or str
        Delay in s, or a text with a unit.
    order : int, optional
        Order of the Padé approximation; the phase is accurate up to about ``order`` rad.
    unit : str, optional
        Unit of the delayed signal; the undelayed signal has an empty unit.

    Returns
    -------
    StateSpace
        Continuous, with ``order`` states.

    Raises
    ------
    UsageError
        A time that is not a positive finite number or text with a unit, or an order that is not 1 to 12.

    Examples
    --------
    >>> from eomgen.control import delay
    >>> late = delay("road", "rear", "0.135 s", unit="m")
    >>> abs(late.frequency_response(10.0, "road", "rear")).round(6)
    np.float64(1.0)
    """
    late, order = number_of("time", time), count_of("order", order)
    most = 12
    if not late > 0.0 or order > most:
        fault = f"a delay of {late:.6g} s by an approximation of order {order!r} [E0371]"
        raise UsageError(Problem("delay", fault, f"a time above zero, and an order from 1 to {most}"))
    series = [(-1.0) ** k / math.factorial(k) for k in range(2 * order + 1)]
    numerator, denominator = (np.asarray(polynomial.coeffs, dtype=float) for polynomial in pade(series, order))
    A, B, C, D = _states_of(numerator, denominator)
    return _filter(A / late, B / late, C, D, input, output, unit, output)


def delay_line(input: str, output: str, samples: int, sample: float | str, unit: str = "") -> StateSpace:
    """Return the exact delay of a sampled model by whole samples, as a model that can drive another model.

    Parameters
    ----------
    input, output : str
        Names of the undelayed signal, the only disturbance of the result, and of the delayed signal, the only output.
    samples : int
        Delay in samples, 1 or more.
    sample : float or str
        Time between two samples in s, or a text with a unit; times that are not positive are not refused.
    unit : str, optional
        Unit of the delayed signal; the undelayed signal has an empty unit.

    Returns
    -------
    StateSpace
        Sampled, with one state for each sample of delay.

    Raises
    ------
    UsageError
        Samples that are not a whole number from 1 on, or a time that is not a positive finite number or text with a
        unit.

    Examples
    --------
    >>> from eomgen.control import delay_line
    >>> len(delay_line("road", "rear", 3, "10 ms").states)
    3
    """
    samples = count_of("samples", samples)
    period = number_of("sample", sample)
    if not period > 0.0:
        fault = f"the time between two samples is {period:.6g} s [E0459]"
        raise UsageError(Problem("sample", fault, "a time above zero"))
    A, B, C = np.eye(samples, k=-1), np.zeros((samples, 1)), np.zeros((1, samples))
    B[0], C[0, -1] = 1.0, 1.0
    line = _filter(A, B, C, np.zeros((1, 1)), input, output, unit, output)
    return replace(line, sample=period)


def _states_of(numerator: Array, denominator: Array) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D of a transfer function."""
    from scipy.signal import tf2ss  # noqa: PLC0415  # slow to import

    A, B, C, D = tf2ss(numerator, denominator)
    return A, B, C, D


def _filter(A: Array, B: Array, C: Array, D: Array, input: str, output: str, unit: str, states: str) -> StateSpace:
    """Return a model with one disturbance `input` and one output, whose matrices are A, B (as E), C and D (as F).
    States are named ``filter.NAME[k]`` after `states`; units of all signals except the output are empty, references
    zero."""
    n = len(A)
    names = tuple(f"filter.{states}" + (f"[{k}]" if n > 1 else "") for k in range(n))
    signals = {"states": [("", 0.0)] * n, "inputs": (), "disturbances": [("", 0.0)], "outputs": [(unit, 0.0)]}
    nothing = (np.zeros((n, 0)), np.zeros((1, 0)))
    E, C, F = (np.asarray(matrix, dtype=float) for matrix in (B, C, D))
    of = (A, nothing[0], E, C, nothing[1], F, names, (), (input,), (output,))
    return StateSpace(*of, **signal_labels(signals))


def _how(space: StateSpace) -> str:
    return "in continuous time" if space.sample is None else f"sampled every {space.sample:.6g} s"


def _unite(first: Sequence[str], second: Sequence[str]) -> list[str]:
    return [*first, *(name for name in second if name not in first)]


def _entering(space: StateSpace, names: Sequence[str]) -> tuple[Array, Array]:
    """Return the gains of inputs and disturbances to the states, columns of B and E, (ns, names), and to the outputs,
    columns of D and F, (ny, names). Columns are zero for names of other models."""
    known = (*space.inputs, *space.disturbances)
    columns = [known.index(name) if name in known else len(known) for name in names]  # the last one is zero
    into_states = np.hstack([space.B, space.E, np.zeros((len(space.B), 1))])
    into_outputs = np.hstack([space.D, space.F, np.zeros((len(space.D), 1))])
    return into_states[:, columns], into_outputs[:, columns]


def _labels(
    kind: str, names: Sequence[str], spaces: Sequence[StateSpace], of_source: Sequence[str]
) -> list[tuple[str, float]]:
    """Return (unit, reference value) of each named signal of a kind, from the first of the models that has the signal,
    from the last one for names ``of_source``. A signal that drives both models may be an input of one model and a
    disturbance of the other model."""
    kinds = ("inputs", "disturbances") if kind in ("inputs", "disturbances") else (kind,)
    homes = [
        next(
            (space, of)
            for space in spaces[:: -1 if name in of_source else 1]
            for of in kinds
            if name in getattr(space, of)
        )
        for name in names
    ]
    return [(space.unit(of, name), space.reference(of, name)) for (space, of), name in zip(homes, names, strict=True)]
