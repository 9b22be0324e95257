"""Eigenvalues of linear models over a parameter: root loci, with the reference state followed from value to value, and
Campbell diagrams, over a tunable parameter or over a velocity of a steady motion.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.messages import nearest, shown
from eomgen.base.progress import Progress
from eomgen.base.progress import show_progress as shown_progress
from eomgen.base.threads import one_thread_of_algebra
from eomgen.compiled.arguments import check_finite, numbers
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.compiled.terms import Inputs
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.lie.numeric import rotated
from eomgen.products.linear.analyses.linearize import AT_ONE_INSTANT, linearize
from eomgen.products.linear.analyses.operating_point import EquilibriumState
from eomgen.products.linear.analyses.standing_axes import StandingAxes
from eomgen.products.linear.campbell_plot import Campbell
from eomgen.products.linear.campbell_search import campbell as diagram
from eomgen.products.linear.eigenvalue_loci import RootLocus
from eomgen.products.linear.eigenvalue_loci import root_locus as followed_roots
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.multiblade import AT_ONE_AZIMUTH, Blades
from eomgen.products.statics.steady_motion import motion_along
from eomgen.products.statics.symmetries import KnownSymmetries

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def root_locus(
    model: CompiledModel,
    parameter: str,
    values: ArrayLike,
    *,
    parameters: Mapping[str, float] | None = None,
    at: str | EquilibriumState | None = None,
    initial: Mapping[str, Any] | None = None,
    t: float = 0.0,
    u: Inputs = None,
    base: ArrayLike | None = None,
    any_kind: bool = False,
    independent: Sequence[str] = (),
    progress: Progress | bool | None = None,
) -> RootLocus:
    """Return the eigenvalues of linear models over values of a tunable parameter, each root followed.

    Parameters
    ----------
    parameter : str
        Tunable parameter.
    values : (n,)
        Values of the parameter, SI units.
    parameters : mapping
        Values of other parameters.
    at, initial, t, u, base, any_kind, independent : as of ``linearize``
        The search for an equilibrium or a steady motion starts at the previous solution.
    progress : callable or bool, optional
        Called with (values done, all values); True shows a bar.

    Returns
    -------
    RootLocus
        ``eigenvalues`` (n, ns) in 1/s, a root in each column, and ``stability`` (n,). After Ctrl-C, which
        ``interrupted`` shows, at the values so far.

    Raises
    ------
    EomgenError
        As of ``linearize``, with the value of the parameter in the message.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> locus = model.root_locus("damper", [500.0, 1000.0, 1500.0])
    >>> locus.eigenvalues.shape
    (3, 4)
    """
    array = _finite_values(values, 1)

    def linearize_at(value: float, before: Linearization | None) -> Linearization:
        near = None if before is None or at == "initial" else state_of(before)
        options: dict[str, Any] = {"t": t, "u": u, "parameters": {**(parameters or {}), parameter: value}, "base": base}
        options |= {"at": at, "initial": near or initial, "any_kind": any_kind, "independent": independent}
        return linearize(model, **options)

    with shown_progress(progress, f"{model.name}: {parameter}") as report, one_thread_of_algebra(model.nv):
        return followed_roots(parameter, array.tolist(), linearize_at, report)


def state_of(lin: Linearization) -> dict[str, Any] | None:
    """Return the state of a linear model as a mapping with ``q``, ``v`` and ``z`` (if any), the form of ``initial``.
    Serves as the start of the search for a neighbouring model. None if the model is about an initial state."""
    r = lin.reference
    if r.what == "initial state":
        return None
    return {"q": r.q, "v": r.v, **({"z": r.z} if len(r.z) else {})}


#: Excitations per turn whose crossings are looked for, if none are given.
ORDERS = (1.0,)
_SPEED = "rad/s"


def campbell(
    model: CompiledModel,
    speed: str,
    values: ArrayLike,
    *,
    orders: Sequence[float] | None = None,
    whirl: Sequence[tuple[str, str]] = (),
    velocities: Mapping[str, float] | None = None,
    coordinates: Mapping[str, ArrayLike] | None = None,
    progress: Progress | bool | None = None,
    at: str | EquilibriumState | None = None,
    initial: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
    t: float = 0.0,
    u: Inputs = None,
    any_kind: bool = False,
    multiblade: Blades | None = None,
    reference: Linearization | None = None,
) -> Campbell:
    """Return the frequencies and whirl of oscillations over the speed of a rotor, and the critical speeds.

    Frequencies are an observer's, also of a shaft that is carried by the spin joint, if the rotor is the same all
    round; a warning says if it is not. Frequencies of blades, without ``multiblade``, are in axes that turn.

    Parameters
    ----------
    speed : str
        A tunable parameter, or a component of the velocity (``spin``) that a steady motion is found for.
    values : array_like
        Values (n,), increasing; rad/s of a speed.
    orders : sequence of float
        Excitations of these multiples of the speed, whose crossings with modes are found to round-off; 1 by default
        if the unit is rad/s.
    whirl : sequence of pairs of str
        Outputs or coordinates that are deflections along two axes that do not turn with the rotor, the second a quarter
        turn from the first in the sense of the spin: ``[("x", "y")]``. A mode whirls forward if the deflections orbit
        in the sense of the spin.
    velocities, coordinates : mappings
        Other given components of the steady motion, as of ``steady_motion``.
    progress : callable or bool, optional
        Called with (steps done, all steps); True shows a bar.
    at, initial, parameters, t, u, any_kind : optional
        As of ``linearize``.
    multiblade : mapping, optional
        As of ``linearize``. Frequencies of an observer on the support of a rotor with three or more equal blades.
        Without ``whirl``, the cosine and sine coordinates of the blades show the sense.
    reference : Linearization
        Model whose ``modes()`` number the modes in tables and pictures; without it oscillations are counted
        by frequency at the first value.

    Returns
    -------
    Campbell
        After Ctrl-C, which ``interrupted`` shows, with the values and crossings found so far.

    Raises
    ------
    UsageError
        A name that is neither, values that do not increase, pairs that are none or hold the rotation itself.
    EomgenError
        As of ``linearize`` and ``steady_motion``, with the value in the message. Values without a linear model are left
        out with a warning as long as two are kept.
    """
    array = _finite_values(values, 2)
    if (array[1:] <= array[:-1]).any():
        raise UsageError(Problem("values", "they do not increase [E0047]", "the smallest first"))
    of_motion = [name.removeprefix("v.") for name in model.v_names]
    is_parameter = speed in model.parameters
    unit = _unit_of_speed(model, speed, of_motion, steady=bool(velocities or coordinates))
    if orders is None:
        orders = ORDERS if unit == _SPEED else ()
    _check_orders(orders, whirl, speed, unit)
    if not is_parameter:
        _check_whirl(model, speed, whirl, initial, parameters)
    found_once = KnownSymmetries()
    standing = StandingAxes(model, () if is_parameter else (speed, *(velocities or {})), t)

    def at_value(value: float) -> dict[str, float]:
        return {**(parameters or {}), **({speed: value} if is_parameter else {})}

    def linearize_at(value: float, before: Linearization | None) -> Linearization:
        """Return the linear model at a value of the speed, from the state of the neighbouring model."""
        near = None if before is None or at == "initial" else state_of(before)
        if is_parameter:
            start = near or initial
            about: dict[str, Any] = {"at": at, "initial": start, "any_kind": any_kind, "multiblade": multiblade}
            return linearize(model, t=t, u=u, parameters=at_value(value), **about)
        moving = {**(velocities or {}), speed: value}
        first = near is None and found_once.fields is None
        try:
            motion = motion_along(model, found_once, moving, coordinates, near or initial, parameters or None, t, u)
        except NumericalError:
            if first:
                raise
            found_once.forget()
            motion = motion_along(model, found_once, moving, coordinates, initial, parameters or None, t, u)
        return linearize(model, t=t, u=u, at=motion, parameters=parameters or None, multiblade=multiblade)

    def linearize_oscillations(value: float, before: Linearization | None) -> Linearization:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", f".*{AT_ONE_AZIMUTH}")  # of signals, on which oscillations do not depend
            warnings.filterwarnings("error", f".*{AT_ONE_INSTANT}")  # frozen eigenvalues are not frequencies
            try:
                linear = linearize_at(value, before)
            except RuntimeWarning:
                fault = f"{AT_ONE_INSTANT} of {speed}, so modes at one instant are not of the motion [E2203]"
                hint = "bending by joints in front of the spin, multiblade for equal blades, or model.floquet"
                raise NumericalError(Problem("campbell", fault, hint)) from None
        return standing.transform(linear, at_value(value), value)

    numbered = None
    if reference is not None:
        of_model = dict(zip(model.parameters, model.parameter_array(parameters or {}).tolist(), strict=True))
        at_speed = of_model[speed] if is_parameter else reference.reference.v[of_motion.index(speed)]
        numbered = float(at_speed), standing.transform(reference, at_value(float(at_speed)), float(at_speed))
    with shown_progress(progress, f"{model.name}: {speed}") as report, one_thread_of_algebra(model.nv):
        result = diagram(speed, unit, array.tolist(), linearize_oscillations, orders, whirl, report, numbered)
    if standing.warning:
        warnings.warn(standing.warning, RuntimeWarning, stacklevel=3)
    return result


def _unit_of_speed(model: CompiledModel, speed: str, of_motion: Sequence[str], *, steady: bool) -> str:
    """Return the unit of the varied quantity.

    Raises
    ------
    UsageError
        A name that is neither a parameter nor a velocity, or a parameter with values of a ``steady`` motion.
    """
    if speed in model.parameters:
        if steady:
            fault = f"{speed} is a parameter, and velocities and coordinates belong to a steady motion [E0045]"
            raise UsageError(Problem("campbell", fault, f"a velocity in place of {speed}, or neither"))
        return next((item.unit for item in model.description.parameters if item.name == speed), "")
    units = dict(zip(of_motion, model.v_units, strict=True))
    if speed not in units:
        known = [*model.parameters, *of_motion]
        fault = f"there is no tunable parameter or velocity {shown(speed)} [E0044]"
        raise UsageError(Problem("campbell", fault, nearest(speed, known)))
    return _SPEED if units[speed] == _SPEED else "m/s"


def _finite_values(values: ArrayLike, least: int) -> Array:
    """Return values as an array (n,). Raises UsageError unless there are as many as the least number, all finite."""
    array = numbers("values", values)
    if array.ndim != 1 or len(array) < least:
        fault = f"the shape is {array.shape}, (n,) with n from {least} on is needed [E0043]"
        raise UsageError(Problem("values", fault, "numpy.linspace(0.0, 300.0, 61)"))
    check_finite("values", array)
    return array


def _check_whirl(
    model: CompiledModel,
    speed: str,
    whirl: Sequence[tuple[str, str]],
    initial: Mapping[str, Any] | None,
    parameters: Mapping[str, float] | None,
) -> None:
    """Raise UsageError for the varied rotation as a deflection; warn of joints in an order against its sense.

    Axes are known of joints with one coordinate, in models with ``poses``.
    """
    for pair in whirl:
        if {speed, f"q.{speed}"}.intersection(pair):
            fault = f"{speed} is the rotation that is varied, and no deflection [E0048]"
            hint = f"deflections along two axes across the axis of {speed}, the second a quarter turn from the first"
            raise UsageError(Problem(f"whirl {':'.join(map(str, pair))}", fault, hint))
    hinges = {item.name: item for item in model.description.drawing.hinges if item.turns != item.slides}
    angles = {name for name in hinges if f"q.{name}" in model.q_names}
    known = [pair for pair in whirl if {speed, *pair} <= angles]
    moving = model.library.layout["facts"]["moving_base"]
    if not known or moving or "poses" not in model.functions or not hinges[speed].turns:
        return
    measures = SceneMeasures(model, model.evaluator.one_set(parameters), 0.0, None)
    bodies = measures.poses(initial_state(model, initial).q[np.newaxis])
    for first, second in known:
        turning = [hinges[name] for name in (first, second, speed)]
        axes = [rotated(bodies[hinge.parent][0][0], np.array(hinge.axis)) for hinge in turning]
        if np.linalg.det(axes) < -0.9:  # across one another
            text = f"whirl {first}:{second} is against the sense of {speed}: the axis of {second} is a quarter turn"
            text += f" before the axis of {first}, so that forward and backward are exchanged"
            warnings.warn(f"campbell: {text}; try: {second}:{first} [W0001]", RuntimeWarning, stacklevel=4)


def _check_orders(orders: Sequence[float], whirl: Sequence[tuple[str, str]], speed: str, unit: str) -> None:
    """Raise UsageError for an order that is not positive, orders of a parameter without a unit of speeds, or an entry
    of `whirl` other than a pair."""
    if bad := [order for order in orders if not order > 0.0]:
        raise UsageError(Problem("orders", f"an order is {bad[0]:.6g} [E0049]", "positive numbers such as (1, 2)"))
    if orders and unit not in ("", _SPEED):
        fault = f"orders are multiples of a speed in rad/s, and {speed} is in {unit} [E2217]"
        raise UsageError(Problem("orders", fault, "no orders, a speed of rotation, or root_locus over a parameter"))

    if wrong := [pair for pair in whirl if isinstance(pair, str) or len(pair) != 2]:
        fault = f"{shown(wrong[0])} is not a pair of deflections [E0050]"
        raise UsageError(Problem("whirl", fault, '[("x", "y")], the second a quarter turn from the first'))
