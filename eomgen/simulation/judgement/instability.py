"""Growth of a motion: by its equations, by instability of the method, or by many orders of magnitude.

Every step of two windows at the end of a run is kept, and of one in its middle. If a velocity and its acceleration
have grown much from window to window, the last window is repeated in smaller steps, from the state in which the window
began. Steps that follow the equations agree on the size of the motion at the end, even if it grows: a pendulum that
falls, negative damping, a controller that diverges. An explicit method beyond its limit of stability grows otherwise,
or not at all, in smaller steps. Sizes are compared and not states, so a phase lag does not matter; neither energies
nor recorded rows are needed.

The largest velocities of the four quarters of a run are compared. A velocity that grows from each to the next by a
large factor grows exponentially: constant forces give factors below 2 after the first quarters.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.errors import UsageError
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.motion_size import at_work
from eomgen.simulation.stepping.chunks import WINDOW, Trajectory
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library

Components = NDArray[np.intp]

#: Growth from window to window above which growth is examined.
_SUDDEN = 10.0
#: Numbers of smaller steps into which each step is cut, tried in order, to repeat sudden and slow growth.
_FINER, _FINER_OF_SLOW = (2, 4, 16, 64, 512), (2, 4)
#: Most steps that slow growth, or the growth before a run stops, is followed over again.
_LONGEST = 4096
#: Ratios of the last size to earlier sizes that are examined after a run has stopped.
_BEHIND = (3.0, 1e2, 1e4, 1e8, 1e16, 1e32)
#: Differences of logarithms, as parts of the logarithm of the growth, up to which two sizes are equal, and above which
#: two sizes are unequal.
_EQUAL, _UNEQUAL = 0.1, 0.5


class Growth(NamedTuple):
    """A component of v, or an internal state, that has grown.

    Attributes
    ----------
    name, unit : of the component
    start, end : s
    before, after : sizes at start and end
    finer : s, the smaller steps in which the motion was looked at again
    finer_after : size at the end of the repetition with smaller steps; infinite if the repetition overflows
    """

    name: str
    unit: str
    start: float
    end: float
    before: float
    after: float
    finer: float
    finer_after: float

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        times = f"between t = {self.start:.6g} and {self.end:.6g} s"
        grown = f"{self.name} grows from {self.before:.3g} to {self.after:.3g}{unit} {times}"
        if not math.isfinite(self.finer_after):
            return f"{grown}, and beyond the finite numbers in steps of {self.finer:.3g} s"
        return f"{grown}, and to {self.finer_after:.3g}{unit} in steps of {self.finer:.3g} s"


class _NotRepeatedError(Exception):
    """A part of a run that cannot be repeated, since functions of the caller have a state or fail between steps."""


def unstable_growth(run: Run, library: Library, trajectory: Trajectory) -> Growth | None:
    """Return the component that grows by the method alone at the end of a run; None without such a component, or if the
    growth is a property of the equations.

    Steps of adaptive methods are not examined, nor is a run that cannot be repeated. If a run stopped, its last steps
    are repeated.
    """
    if run.method.chooses_steps:
        return None
    try:
        return _unstable_growth(run, library, trajectory)
    except _NotRepeatedError:
        return None


def _unstable_growth(run: Run, library: Library, trajectory: Trajectory) -> Growth | None:
    """Return the component that grew in the last steps by the method alone, suddenly or slowly; None if none did, or if
    the last steps are not known. Raises _NotRepeatedError."""
    end = _last_steps(run, library, trajectory.rows) if trajectory.status else trajectory.end
    if end is None or len(end) < 2:
        return None
    half = (len(end) - 1) // 2
    before, after, middle = end[: max(half, 1)], end[half:], trajectory.middle
    late = _sizes(run, after[1:])
    growth = _growth(_sizes(run, before), late)
    sudden = _growing_components(run, after, growth, late[0], _SUDDEN)
    if len(sudden):
        return _by_method(run, library, after, before, sudden, _FINER)
    if middle is None:
        return None
    growth = _growth(_sizes(run, middle), late)
    slow = _growing_components(run, after, growth, late[0], 1e3)
    if not len(slow):
        return None
    steps = round((after[-1, 0] - middle[0, 0]) / run.settings["step"])
    rate = math.log(np.minimum(growth[slow], sys.float_info.max).max()) / steps
    again = _again(run, library, middle[0], min(math.ceil(4.0 / rate), steps, _LONGEST), 1)
    if again is None or len(again) < 2 * WINDOW:
        return None
    return _by_method(run, library, np.concatenate([middle[:1], again]), middle, slow, _FINER_OF_SLOW)


def _last_steps(run: Run, library: Library, rows: Array) -> Array | None:
    """Return a row after each of the last steps before a run stopped, by a repetition from a recorded row. At most two
    windows of rows (n, width), the last recorded state included. None if no recorded row lies near enough, or if the
    repetition fails."""
    steps = np.rint((rows[-1, 0] - rows[:, 0]) / run.settings["step"]).astype(int)
    first = int(np.flatnonzero(steps >= min(2 * WINDOW, steps[0]))[-1])
    if steps[first] > _LONGEST:
        return None
    again = _again(run, library, rows[first], int(steps[first]), 1)
    return None if again is None else np.concatenate([rows[first : first + 1], again])[-2 * WINDOW - 1 :]


def own_growth(run: Run, library: Library, rows: Array) -> Growth | None:
    """Return the component that grew by the equations of motion shortly before a run stopped; None if none is known.

    Steps that go wrong near an infinity grow too: so the growth up to smaller and smaller sizes is compared.

    Parameters
    ----------
    rows : (n, width)
        The recorded rows, the last of which is the last good state.
    """
    try:
        return _own_growth(run, library, rows)
    except _NotRepeatedError:
        return None


def _own_growth(run: Run, library: Library, rows: Array) -> Growth | None:
    """Return the component whose growth near the end of the rows is the same in smaller steps; None if there is none.
    Raises _NotRepeatedError."""
    rows = rows[-_LONGEST:]
    sizes = np.array([_sizes(run, row[np.newaxis])[0] for row in rows])
    largest = np.maximum.accumulate(sizes)  # a passage through zero is not growth
    # velocities whose travel within a step is rounding of the coordinates are at rest, and have no ratio
    travel = np.finfo(float).eps * _lengths(run, rows) / run.settings["step"]
    with np.errstate(over="ignore"):
        moves = largest > np.concatenate([travel, np.zeros(run.model.nz)])
        behind = np.divide(sizes[-1], largest, out=np.zeros_like(sizes), where=moves)
    grown = _growing_components(run, rows, np.max(behind, axis=0), sizes[-1], _SUDDEN)
    if not len(grown):
        return None
    component = int(grown[np.argmax(np.max(behind[:, grown], axis=0))])
    step, near = run.settings["step"], max(2 * WINDOW, len(rows) // 10)
    for least in _BEHIND:
        late, early = (np.flatnonzero(behind[:, component] >= factor) for factor in (least, _SUDDEN * least))
        if not len(late) or not len(early) or late[-1] < len(rows) - near:
            return None
        first, last = rows[early[-1]], rows[late[-1]]
        steps = round((last[0] - first[0]) / step)
        if not 0 < steps <= _LONGEST:
            return None
        before, after = sizes[early[-1], component], sizes[late[-1], component]
        if not _diverges(rows[early[-1] : late[-1] + 1, 0], largest[early[-1] : late[-1] + 1, component]):
            return None
        again = [_again(run, library, first, steps, parts) for parts in _FINER_OF_SLOW]
        finer = [
            math.inf if repeated is None else float(_sizes(run, repeated[-1:])[0][component]) for repeated in again
        ]
        if all(size > 0.0 and abs(math.log(size / after)) < _EQUAL * math.log(after / before) for size in finer):
            return _as_growth(run, (first[0], last[0]), component, before, after, step / _FINER_OF_SLOW[-1], finer[-1])
    return None


def _diverges(times: Array, sizes: Array) -> bool:
    """Return whether a size (n,) grows over times (n,) like an exponential or faster. The logarithm then rises in the
    second half of the time by about half of its total; a power of time, as after a start from rest, rises less."""
    middle = np.interp(0.5 * (times[0] + times[-1]), times, np.log(sizes))
    # an exponential has 0.5, the fifth power of time 0.44 over a factor of 10, and lower powers less
    return bool(np.log(sizes[-1]) - middle > 0.45 * np.log(sizes[-1] / sizes[0]))


def at_rest(run: Run, rows: Array) -> bool:
    """Return whether the system is at rest in rows (n, width), to rounding, by velocities and by changes between rows.

    Velocities of a stiff component may exceed the bound at rest, since rounding of its coordinate oscillates at a high
    frequency; then velocities must be small from row to row and coordinates must stay. A single row is always at rest,
    and internal states do not count.
    """
    q = rows[:, 1 : 1 + run.model.nq]
    longest = _longest(run, rows)
    sizes = np.array([longest if unit == "m" else 1.0 for unit in run.model.q_units])
    between = float(np.max(np.ptp(q, axis=0) / np.where(sizes > 0.0, sizes, 1.0), initial=0.0))
    if np.any(_travelling(run, rows, SUMMED)[: run.model.nv]):
        hardly = not np.any(_travelling(run, rows, COMPUTED * (len(rows) - 1))[: run.model.nv])  # from row to row
        return hardly and between <= SUMMED
    return between <= COMPUTED


def _by_method(
    run: Run, library: Library, window: Array, before: Array, components: Components, finer: Sequence[int]
) -> Growth | None:
    """Return the growth of the component that grows by the method's instability; None if smaller steps grow alike.

    The window is stepped again from its first row with smaller and smaller steps. A component that stays much smaller
    then has grown by the method, and so has a component whose size does not settle with the steps; the worst is
    returned.

    Parameters
    ----------
    window : (steps + 1, width) rows of the run, of which the last give the size after the growth
    before : (n, width) earlier rows, which give the size before the growth
    components : indices of the components of v and z that have grown
    finer : numbers of parts into which each step is divided, in the order of the repetitions
    """
    steps, step = len(window) - 1, run.settings["step"]
    tail, times = min(steps, WINDOW), (window[0, 0], window[-1, 0])
    small, large = (_sizes(run, rows)[0][components] for rows in (before, window[-tail:]))
    sizes = np.full(len(components), math.inf)
    agreeing = np.zeros(len(components), dtype=int)
    moved = _travelling(run, window, WRITTEN)[components]
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        growth = np.log(np.minimum(large / small, sys.float_info.max))
        # growth before or after the window cannot be compared
        moved &= growth > 1.0
        for parts in finer:
            coarser, again = sizes, _again(run, library, window[0], steps, parts)
            sizes = np.full(len(components), math.inf) if again is None else _sizes(run, again[-tail:])[0][components]
            excess = np.log(large / sizes)
            worst = np.flatnonzero((excess > _UNEQUAL * growth) & moved)
            if len(worst):
                fastest = worst[np.argmax(excess[worst])]
                rest = finer[finer.index(parts) :]
                held, size = _refined_size(run, library, window, components[fastest], rest, _EQUAL * growth[fastest])
                return _as_growth(run, times, components[fastest], small[fastest], large[fastest], step / held, size)
            agreeing = np.where(np.abs(np.log(coarser / sizes)) < _EQUAL * growth, agreeing + 1, 0)
            if np.all(((agreeing > 1) & (excess > -_UNEQUAL * growth)) | ~moved):
                return None
    left = np.flatnonzero((agreeing == 0) & moved)
    if finer is _FINER_OF_SLOW or not len(left):
        return None
    fastest = left[np.argmax(growth[left])]
    return _as_growth(run, times, components[fastest], small[fastest], large[fastest], step / finer[-1], math.inf)


def _refined_size(
    run: Run, library: Library, window: Array, component: int, finer: Sequence[int], equal: float
) -> tuple[int, float]:
    """Return the coarsest cut of steps whose next refinement gives the same size of a component, and this size. Steps
    from the first row of the window are repeated in each of the numbers of parts in `finer`. Sizes are the same if
    their logarithms differ by less than `equal`; infinite if a repetition fails. The last refinement if none agrees."""
    steps, parts, size = len(window) - 1, finer[0], np.float64(np.inf)
    for more in finer:
        again = _again(run, library, window[0], steps, more)
        size_of_finer = np.float64(np.inf) if again is None else _sizes(run, again[-min(steps, WINDOW) :])[0][component]
        if np.abs(np.log(size / size_of_finer)) < equal:
            break
        parts, size = more, size_of_finer
    return parts, float(size)


def _as_growth(
    run: Run, times: tuple[float, float], component: int, before: float, after: float, finer: float, finer_after: float
) -> Growth:
    names, units = [*run.model.v_names, *run.model.z_names], [*run.model.v_units, *run.model.z_units]
    start, end = map(float, times)
    return Growth(
        names[component], units[component], start, end, float(before), float(after), finer, float(finer_after)
    )


def _growing_components(run: Run, rows: Array, growth: Array, size: Array, least: float) -> Components:
    """Return the indices, in (v, z), of components that grow at least by the factor `least` and are more than rounding:
    velocities compared with the largest one in their unit, internal states with their response to the motion in `rows`
    (n, width). `growth` and `size` are (nv + nz,)."""
    grown = np.flatnonzero(growth >= least)
    if not len(grown):
        return grown
    units = np.array(run.model.v_units)
    scales = np.array([size[: len(units)][units == unit].max() for unit in units])
    states = at_work(run, rows, run.parameters).states if grown[-1] >= len(units) else size[len(units) :]
    return grown[size[grown] > WRITTEN * np.concatenate([scales, states])[grown]]


def _growth(before: Array, after: Array) -> Array:
    """Return the growth factors of velocities and internal states, (nv + nz,): for a velocity the smaller factor among
    velocity and acceleration.

    Parameters
    ----------
    before, after : (2, nv + nz) as of ``_sizes``
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        factors = after / before
    smaller: Array = np.fmin(factors[0], factors[1])
    return smaller


def _sizes(run: Run, rows: Array) -> Array:
    """Return the largest absolute velocities, and accelerations, of rows (n, width), as an array (2, nv + nz). The
    largest absolute internal states stand in both."""
    nq, nv, nz = run.model.nq, run.model.nv, run.model.nz
    size = np.abs(rows).max(axis=0)
    moving = size[1 + nq : 1 + nq + 2 * nv].reshape(2, nv)
    return np.hstack([moving, np.broadcast_to(size[len(size) - nz :], (2, nz))]) if nz else moving


def _travelling(run: Run, rows: Array, part: float) -> NDArray[np.bool_]:
    """Return a mask (nv + nz,) of the components that move over the rows (n, width) by more than a part of their scale.
    A velocity's travel, its largest value times the time of the rows, is compared with `part` of the largest coordinate
    in m, or of a radian; an internal state that is not zero moves."""
    model = run.model
    size = _sizes(run, rows)[0]
    travel = size[: model.nv] * (rows[-1, 0] - rows[0, 0])
    return np.concatenate([travel > part * _lengths(run, rows), size[model.nv :] > 0.0])


def _lengths(run: Run, rows: Array) -> Array:
    """Return the size that a travel of each velocity is compared with, (nv,): the coordinates, or a radian."""
    longest = _longest(run, rows)
    return np.array([longest if unit == "m/s" else 1.0 for unit in run.model.v_units])


def _longest(run: Run, rows: Array) -> float:
    """Return the largest coordinate in m at the first of some rows."""
    lengths = [index for index, unit in enumerate(run.model.q_units) if unit == "m"]
    return float(np.max(np.abs(rows[0, 1 : 1 + run.model.nq][lengths]), initial=0.0))


def _again(run: Run, library: Library, row: Array, steps: int, parts: int) -> Array | None:
    """Return the rows (steps, width) after each of some steps from a row, with every step cut into equal parts. None if
    not all steps can be taken. Raises _NotRepeatedError if a function of the caller keeps data or fails."""
    model = run.model
    if run.controllers is not None and run.controllers.undeclared_names:
        raise _NotRepeatedError
    settings = {**run.settings, "step": run.settings["step"] / parts}
    stepper = Stepper(library, settings, run.parameters, run.controllers)
    t, q, v = float(row[0]), row[1 : 1 + model.nq], row[1 + model.nq : 1 + model.nq + model.nv]
    try:
        table = None if run.driven is None else np.ascontiguousarray(run.driven(stepper.times_of(0, steps * parts, t)))
    except UsageError:  # a function of the caller that fails between the steps of the run
        raise _NotRepeatedError from None
    if stepper.initialize(t, q, v, table, row[len(row) - model.nz :]):
        return None
    record = np.empty((steps + 1, stepper.sizes["row"]))
    status, rows = stepper.run(steps * parts, parts, table, record)
    return None if status or rows < steps else record[:rows]


EACH = Limit(10.0, "1", "growth of a velocity from quarter to quarter of a run", "constant forces give less than 2")
OVERALL = Limit(1e6, "1", "the same from the first to the last quarter", "a choice")
#: Relative to the largest coordinate in m, or to a radian.
FAR_TRAVEL = Limit(1e3, "1", "travel in the last quarter in parts of the first", "swings and falls travel less")


def unbounded_growth(run: Run, states: States) -> Finding | None:
    """Return a finding on the velocity that grows most from quarter to quarter of a run; None if none grows
    exponentially and far, or if a quarter has too few rows. Other checks find growth by the method's instability."""
    quarters = np.array_split(np.arange(len(states.t)), 4)
    if not run.model.nv or len(quarters[-1]) < 8:
        return None
    sizes = np.array([np.abs(states.v[rows]).max(axis=0) for rows in quarters])
    lengths = [index for index, unit in enumerate(run.model.q_units) if unit == "m"]
    longest = float(np.abs(states.q[quarters[0]][:, lengths]).max(initial=0.0)) or 1.0
    scales = np.array([longest if unit == "m/s" else 1.0 for unit in run.model.v_units])
    travel = sizes[-1] * (states.t[-1] - states.t[quarters[-1][0]])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        each, overall = (sizes[1:] / sizes[:-1]).min(axis=0), sizes[-1] / sizes[0]
    grown = np.flatnonzero(
        (each >= EACH) & (overall >= OVERALL) & (travel > FAR_TRAVEL * scales) & np.isfinite(overall)
    )
    if not len(grown):
        return None
    entry = grown[np.argmax(overall[grown])]
    name, unit = run.model.v_names[entry], run.model.v_units[entry]
    samples = ", or a shorter time between samples" if "samples" in run.model.library.layout["method"] else ""
    first, last = (f"{sizes[quarter, entry]:.3g} {unit}" for quarter in (0, -1))
    span = f"from at most {first} in the first quarter of the run to {last} in the last one"
    text = f"the motion grows without end: {name} by a factor of {overall[entry]:.2g}, {span}"
    hint = f"other signs or sizes of gains, damping and stiffnesses{samples}"
    return Finding(value=float(overall[entry]), text=text, hint=hint)
