"""Events of a compiled run: the stepper's log as arrays, modes over time, and sentences on how events end a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.model import CompiledModel
from eomgen.integrators.events import ACCUMULATED, AT_EVENTS, NO_VALUE, STOPPED
from eomgen.lie import product
from eomgen.results.events import Events
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.states import states_of
from eomgen.simulation.stepping.stepper import Stepper, entry_type
from eomgen.system.events import mode_parameter

if TYPE_CHECKING:
    from eomgen.simulation.stepping.run import Run


def table_of(trajectory: Trajectory, stepper: Stepper, p: Array) -> Events | None:
    """Return the events of a finished run, with states before and after each, from the logs of its trajectory. None if
    the scene has no events. `p` (np,) are the parameters of the run, with the modes at its start."""
    data = stepper.layout["method"].get("events")
    if data is None:
        return None
    kind = entry_type(stepper.layout, stepper.library.real)
    log = np.concatenate([np.empty(0, kind), *trajectory.events])
    names = [row["name"] for row in data["rows"]]
    sizes = {letter: int(stepper.layout["sizes"][letter]) for letter in "qvz"}

    def block(name: str) -> Array:
        empty = name == "modes" or not sizes[name[0]]
        if name in (log.dtype.names or ()):
            return np.ascontiguousarray(log[name], dtype=float)
        return np.empty((len(log), 0 if empty else sizes[name[0]]))

    counts = dict(zip(names, stepper.state[stepper.places["event_count"]].astype(int).tolist(), strict=True))
    return Events(
        names=tuple(names[k] for k in log["event"]),
        t=np.ascontiguousarray(log["t"], dtype=float),
        **{name: block(name) for name in ("q_before", "v_before", "z_before", "q", "v", "z", "modes")},
        counts=counts,
        mode_names=tuple(mode["name"] for mode in data["modes"]),
        first_modes=p[[mode["parameter"] for mode in data["modes"]]] if trajectory.modes is None else trajectory.modes,
    )


def acting(events: Events | None, layout: Mapping[str, Any]) -> Array:
    """Return the times, (n,) s, of the events that changed the motion: all whose action is not to record or count.
    Empty if `events` is None; `layout` is the library's."""
    if events is None:
        return np.empty(0)
    passive = {row["name"] for row in layout["method"]["events"]["rows"] if row["action"] in ("record", "count")}
    return np.array([time for name, time in zip(events.names, events.t, strict=True) if name not in passive])


def parameters_over(events: Events | None, model: CompiledModel, p: Array, t: Array) -> Array:
    """Return the parameters (..., np) with the modes that hold at times (...) in s; p itself, (np,), without modes. At
    the time of an event the mode after the event holds."""
    if events is None or not events.mode_names:
        return p
    values = np.concatenate([events.first_modes[np.newaxis], events.modes])
    slack = 8.0 * float(np.finfo(float).eps) * np.abs(t).max(initial=0.0)
    return parameters_with(events, model, p, values[np.searchsorted(events.t, t + slack, side="right")])


def parameters_with(events: Events, model: CompiledModel, p: Array, modes: Array) -> Array:
    """Repeat parameters p (np,) with the columns of discrete modes set to ``modes`` (..., modes): (..., np)."""
    columns = [list(model.parameters).index(mode_parameter(name)) for name in events.mode_names]
    result = np.broadcast_to(p, (*modes.shape[:-1], len(p))).copy()
    result[..., columns] = modes
    return result


def without_value(run: Run, rows: Array, events: Events | None) -> list[str]:
    """Return the names of the events whose formula, or rate of the formula, has no finite value in the next step.

    The state of the last row is moved on at its accelerations over one step.

    Parameters
    ----------
    rows : (n, width) of the record
    events : of the run; the step continues from the last event if this event is later than the last row
    """
    model, p, step = run.model, run.parameters, run.settings["step"]
    t, q, v, a, multipliers, z = (part[0] for part in states_of(rows[-1:], model))
    if events is not None and len(events) and events.t[-1] > t:
        *_, event = events
        t, q, v, z, p = event.t, event.q, event.v, event.z, parameters_with(events, model, p, event.modes)
    arguments = {"multipliers": multipliers} if model.multipliers else {}
    a = np.where(np.isfinite(a), a, 0.0)
    names = [row["name"] for row in model.library.layout["method"]["events"]["rows"]]
    missing = np.zeros(len(names), dtype=bool)
    with np.errstate(all="ignore"):
        for share in np.linspace(0.0, 1.0, 65):
            time = share * step
            u = run.signals.rows(np.array([t + time]))[0] if model.nu else None
            ahead = product.update(model.factors, q, time * v + 0.5 * time**2 * a), v + time * a, a, t + time, u
            functions = model.evaluate("events", *ahead, z=z, parameters=p, **arguments)
            missing |= ~(np.isfinite(functions["event"]) & np.isfinite(functions["event_rate"]))
    return [name for name, is_missing in zip(names, missing, strict=True) if is_missing]


def ending(status: int, stepper: Stepper, without_value: Sequence[str] = ()) -> str:
    """Return a sentence on the event that ended a run with this status of its stepper; empty for other statuses.

    Parameters
    ----------
    stepper : in the state at the end
    without_value : names of events whose formula has no value ahead; empty if that is not known
    """
    if status not in AT_EVENTS and status != NO_VALUE.number:
        return ""
    data = stepper.layout["method"]["events"]["rows"]
    if status == NO_VALUE.number:
        names = ", ".join(without_value) or f"one of {', '.join(row['name'] for row in data)}"
        return f"stopped at t = {stepper.t:.9g} s: {stepper.status_text(status)} ({names}) [E2048]"
    row = data[int(stepper.state[stepper.places["event_last"]][0])]
    count = int(stepper.state[stepper.places["event_count"]][data.index(row)])
    if status == STOPPED.number:
        return f"stopped by the event {row['name']} at t = {stepper.t:.9g} s [E2049]"
    if status == ACCUMULATED.number:
        again = f"the event {row['name']} comes again and again at t = {stepper.t:.9g} s"
        if least := row["least_interval"]:
            return f"{again}, sooner than its least_interval of {least:.6g} s, after {count} before [E2051]"
        return f"{again}, {count} times so far: the motion comes to rest there, or it chatters [E2050]"
    return f"at t = {stepper.t:.9g} s, the event {row['name']}: {stepper.status_text(status)} [E2047]"
