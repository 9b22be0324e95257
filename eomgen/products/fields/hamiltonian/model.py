"""``HamiltonianModel``: a compiled Hamiltonian system with a NumPy face, and its runs."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import Defaults, NamedAttributes, NamedResults, checked_calls
from eomgen.base.messages import listed, nearest, shown
from eomgen.base.rounding import WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.adaptive import check_tolerance
from eomgen.products.fields.documents.document import (
    DEPENDENCES,
    NO_START,
    Hamiltonian,
    NamedNumber,
    StateOutput,
    check_step_count,
)
from eomgen.products.fields.hamiltonian.methods import KINDS, Method, method_for
from eomgen.products.fields.hamiltonian.solution import HamiltonianSolution, StepErrors, by_tolerance, estimate_errors
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.library import Library

#: Values in place of the file's, by name.
_Parameters = Mapping[str, float] | None
#: Size and number of steps, and the number of these between rows.
_Grid = tuple[float, int, int]
#: Seconds between looks at the keyboard.
_SECONDS_AT_ONCE = 0.1
_COUNTED = ("steps", "gradients", "iterations", "products")
#: Reasons for the end of a run, by the status returned by C.
_STATUSES = {
    1: "the equations of an implicit step were not solved by Newton's method; try: a step smaller than {step:.3g}",
    2: "the step of rk45 became too small for the time to move on: the motion has a singularity near; try: a larger"
    " tolerance, or another end",
    4: "steps of rk45 within one of the grid were too many; try: a larger tolerance, or a grid step below {step:.3g}",
    3: "a value became infinite or not a number; try: a step smaller than {step:.3g}, or another start",
}


def built_library(document: Hamiltonian, content: bytes, builder: Builder) -> Library:
    """Return the compiled library of a system, from the cache if present, else compiled and stored there. ``content``
    are the bytes that determine the library, the key in the cache; ``builder`` finds and compiles libraries."""
    result = builder.find(content)
    if result is not None:
        return result
    from eomgen.codegen.metadata import interface_layout  # noqa: PLC0415  # a cached library needs none of this
    from eomgen.products.fields.hamiltonian.code import CDEF, library_files, program_of  # noqa: PLC0415

    with builder.claim(content):
        result = builder.find(content)
        if result is not None:
            return result
        program = program_of(document)
        return builder.build(content, library_files(document, program), CDEF, interface_layout(program))


@checked_calls(
    'eomgen.build("system.toml"), which makes one', dt="step", h="step", integrator="method", rtol="tolerance",
    tol="tolerance", atol="tolerance", params="parameters", x0="initial", t="t_end", duration="t_end",
)  # fmt: skip
class HamiltonianModel(NamedAttributes):
    """A compiled system of q' = dH/dp, p' = -dH/dq.

    Attributes
    ----------
    document : Hamiltonian
        Description of the system.
    name : str
    q_names, p_names : lists of str
        Coordinates and momenta.
    parameters : mapping
        Values in the file, by name. A run with other values evaluates dependent formulas again.
    separable : bool
        Whether H is T(p) + V(q), so that steps of drifts and kicks are exact for each part.
    """

    def __init__(self, document: Hamiltonian, library: Library) -> None:
        self.document = document
        self.library = library
        self.name = document.name
        self.q_names = [item.name for item in document.coordinates]
        self.p_names = [item.name for item in document.momenta]
        values = document.parameter_values({})
        self.parameters = Defaults("parameter", values, 'model.simulate(..., parameters={"m": 2.0}) for one run')
        self.separable = document.separable

    def __repr__(self) -> str:
        kind = "separable" if self.separable else "not separable"
        return f"HamiltonianModel({self.name}: {self.n} coordinates, {kind})"

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.q_names)

    def energy(self, q: ArrayLike, p: ArrayLike, parameters: _Parameters = None) -> Any:
        """Return H at a state, or at each of several.

        Parameters
        ----------
        q, p : (n,) or (states, n)
        parameters : mapping, optional
            By name; the file's by default.
        """
        total = self._call("hamiltonian", [q, p], parameters)[0].sum(axis=-1)
        return float(total) if total.ndim == 0 else total

    def gradient(self, q: ArrayLike, p: ArrayLike, parameters: _Parameters = None) -> tuple[Array, Array]:
        """Return dH/dq and dH/dp, of the shapes of q and p; parameters as in ``energy``."""
        dq, dp = self._call("gradient", [q, p], parameters)
        return dq, dp

    def hessian_product(
        self, q: ArrayLike, p: ArrayLike, dq: ArrayLike, dp: ArrayLike, parameters: _Parameters = None
    ) -> tuple[Array, Array]:
        """Return the product of the Hessian of H with a direction: the changes of dH/dq and dH/dp along dq, dp.

        Parameters
        ----------
        q, p, dq, dp : (n,) or (states, n)
        """
        along_q, along_p = self._call("hessian_product", [q, p, dq, dp], parameters)
        return along_q, along_p

    def largest_frequency(self, q: ArrayLike, p: ArrayLike, parameters: _Parameters | Array = None) -> float:
        """Return the largest modulus of the eigenvalues of the motion linearised about a state, per unit of time."""
        n = self.n
        rows = np.eye(2 * n)
        states = [np.broadcast_to(np.asarray(x, float), (2 * n, n)) for x in (q, p)]
        by_q, by_p = self._call("hessian_product", [*states, rows[:, :n], rows[:, n:]], parameters)
        flow = np.hstack([by_p, -by_q]).T
        return float(np.abs(np.linalg.eigvals(flow)).max()) if np.isfinite(flow).all() else math.inf

    def simulate(
        self,
        t_end: float | None = None,
        step: float | None = None,
        *,
        method: str | None = None,
        first: str = "drift",
        initial: Mapping[str, Any] | None = None,
        parameters: Mapping[str, float] | None = None,
        record_every: int | None = None,
        compensated: bool | None = None,
        tolerance: float | None = None,
        error_estimate: bool = True,
    ) -> HamiltonianSolution:
        """Return the motion from t = 0 to an end in equal steps.

        Parameters
        ----------
        t_end, step : float
            The file's by default; negative steps go backwards.
        method : str
            If H is T(p) + V(q): ``leapfrog``, ``minimum_norm2``, ``bcss3``, ``omf4``, ``blanes_moan4``,
            ``blanes_moan6``, ``kahan_li6``, ``kahan_li8``, and for even orders to 12 ``yoshida<order>``,
            ``suzuki<order>`` and ``creutz_gocksch<order>_<i>``. ``implicit_midpoint`` and, for even orders from 4
            to 12, ``gauss<order>`` for any H, as ``rk4`` and ``rk45``, which are not symplectic; of recursions of
            leapfrogs implicit midpoint steps take the place if H is not separable. The file's by default, else
            ``omf4``, or ``gauss6`` if H is not separable.
        first : str
            Whether steps of compositions begin with a ``drift`` or a ``kick``.
        initial : mapping
            ``q`` and ``p`` as arrays, or coordinates and momenta by name; the rest is the file's, whose formulas have
            the parameters of this run.
        parameters : mapping
            By name; the rest is the file's, whose formulas follow the parameters that are given.
        record_every : int
            Steps between recorded rows; the first and the last state are always recorded.
        compensated : bool
            Keep the rounding errors of sums for the following sums: for 1e6 steps and more.
        tolerance : float
            Of ``rk45`` with adaptive steps within the steps of the grid: local errors as parts of the state. The file's
            by default.
        error_estimate : bool
            Estimate the errors of steps by runs in steps twice and four times as long, or half as long if these
            are inconclusive, of ``rk45`` by one at a tenth of the tolerance: 0.75 to 2.75 times the time of the run.

        Raises
        ------
        UsageError
            An unknown method, parameter or coordinate, or a time that is not a whole number of steps.
        """
        run = self.document.simulation
        t_end = run.duration if t_end is None else _finite("t_end", t_end)
        step = run.step if step is None else _finite("step", step)
        every = count_of("record_every", run.record_every if record_every is None else record_every)
        chosen = method_for(self.document, method, first)
        steps = _whole_steps(t_end, step)
        if tolerance is not None and not chosen.chooses_steps:
            fault = f"{chosen.name} takes equal steps, and a tolerance belongs to rk45 [E0780]"
            raise UsageError(Problem("tolerance", fault, f'method="rk45", or a step below {abs(step):.6g}'))
        allowed = run.tolerance if tolerance is None else _finite("tolerance", tolerance)
        check_tolerance(allowed)
        values = self._values(parameters)
        state = self._start(initial, values)
        began = time.perf_counter()
        kept = run.compensated if compensated is None else bool(compensated)
        rows, counted, status = self._steps(chosen, (step, steps, every), state, values, allowed, compensated=kept)
        seconds = time.perf_counter() - began
        taken = np.minimum(np.arange(len(rows)) * every, counted[0])

        def run_for_comparison(multiple: float, spacing: int, by_tolerance: float = 1.0) -> Array | None:
            grid = (multiple * step, round(steps / multiple), round(spacing / multiple))
            result, _, ended = self._steps(chosen, grid, state, values, allowed * by_tolerance, compensated=kept)
            if ended < 0:
                raise KeyboardInterrupt
            return result if ended == 0 else None

        errors = StepErrors(reason="the run did not reach its end" if status else "it was switched off")
        if error_estimate and not status:
            names = [*self.q_names, *self.p_names]
            try:
                if chosen.chooses_steps:
                    finer = run_for_comparison(1.0, every, 0.1)
                    errors = by_tolerance(rows, finer, taken * step, allowed, names)
                else:
                    errors = estimate_errors(rows, step, every, steps, chosen.order, names, run_for_comparison)
            except KeyboardInterrupt:  # the rows so far are kept
                errors = StepErrors(reason="it was interrupted")
        t, q, p = taken * step, rows[:, : self.n].copy(), rows[:, self.n :].copy()
        energy, outputs = self._energies_and_outputs(q, p, values)
        changed, exploded = _change_of_energy(energy, chosen, step)
        ends = f"reached t = {t[-1]:.9g} in {steps} steps", f"interrupted at t = {t[-1]:.9g}"
        failure = f"stopped after t = {t[-1]:.9g}: {_STATUSES.get(status, '').format(step=abs(step))}"
        ending = failure if status > 0 else ends[-status]
        notes = [ending, self._too_large(chosen, step, state[0], values), changed]
        return HamiltonianSolution(
            t,
            q,
            p,
            NamedResults("part of H", energy),
            outputs,
            {**dict(zip(_COUNTED, counted, strict=True)), "wall_time": seconds},
            status == 0 and not exploded,
            "; ".join(note for note in notes if note),
            self._metadata(chosen, first, step, allowed, kept, values),
            errors,
            interrupted=status < 0,
        )

    def _energies_and_outputs(self, q: Array, p: Array, values: Array) -> tuple[dict[str, Array], NamedResults[Array]]:
        """Return the parts of H with ``total``, and the outputs, by name, (rows,) each, at states q and p, (rows, n)
        each. A separable H has no coupled part."""
        parts = self._call("hamiltonian", [q, p], values)[0]
        named = DEPENDENCES[:2] if self.separable else DEPENDENCES
        energy = {**dict(zip(named, parts.T, strict=False)), "total": parts.sum(axis=1)}
        y = self._call("observed", [q, p], values)[0].T if self.document.outputs else ()
        names = [item.name for item in self.document.outputs]
        return energy, NamedResults("output", dict(zip(names, y, strict=True)))

    def _metadata(
        self, chosen: Method, first: str, step: float, tolerance: float, compensated: bool, values: Array
    ) -> dict[str, Any]:
        """Return the settings of a run, the parameters, and names and units of columns, in JSON types."""
        document = self.document
        columns: dict[str, Sequence[NamedNumber | StateOutput]]
        columns = {"q": document.coordinates, "p": document.momenta, "outputs": document.outputs}
        return {
            "name": self.name,
            "method": chosen.name,
            "order": chosen.order,
            "first": first if chosen.is_composition else "",
            "step": step,
            "tolerance": tolerance if chosen.chooses_steps else None,
            "compensated": compensated,
            "parameters": dict(zip(self.parameters, values.tolist(), strict=True)),
            "names": {key: [item.name for item in items] for key, items in columns.items()},
            "units": {key: [item.unit for item in items] for key, items in columns.items()},
        }

    def _steps(
        self, method: Method, grid: _Grid, state: Array, values: Array, tolerance: float, *, compensated: bool
    ) -> tuple[Array, list[int], int]:
        """Make the steps of a run, and return rows (rows, 2 n) of q and p, counts in the order in ``_COUNTED``, and the
        status: 0 at the end, -1 interrupted, else a key in ``_STATUSES``.

        ``grid`` is the step, the number of steps, and the number of these between rows; ``state`` (1, 2 n) the start;
        ``values`` all parameters. Calls of C also end within rows, so that Ctrl-C takes effect, with the bits of a
        single call; an interrupted run has the last state as last row.
        """
        n, ffi, (step, steps, every) = self.n, self.library.ffi, grid
        whole, rest = divmod(steps, every)
        size = 1 + whole + (rest > 0), 2 * n
        if (needed := 4 * 8 * size[0] * size[1]) > 4e9:  # copies that a run makes
            fault = f"{size[0]:.6g} rows of {2 * n} numbers would take about {needed / 1e9:.3g} GB [E0786]"
            hint = f"record_every={math.ceil(steps * needed / size[0] / 4e9)}"
            raise UsageError(Problem("record_every", fault, hint))
        record = np.empty(size)
        motion = np.concatenate([state.ravel(), np.zeros(2 * n + 1)])
        record[0] = motion[: 2 * n]
        arguments = (
            values if len(values) else np.zeros(1),
            method.fractions,
            (*method.A, *method.b, *method.error, 0.0),
        )
        numbers = [ffi.from_buffer("double[]", np.array(array)) for array in arguments]
        memories = [ffi.from_buffer("double[]", array) for array in (np.empty(method.work(n) + 1), motion)]
        tally = ffi.new("long[5]")

        def run(row: int, rows: int, length: int, *, more: bool) -> int:
            target = ffi.from_buffer("double[]", record[row : row + max(rows, 1)])
            result: int = self.library.lib.eomgen_hamiltonian_run(
                numbers[0], step, rows, length, more, KINDS.index(method.kind), len(method.fractions), numbers[1],
                method.stages, numbers[2], tolerance, compensated, *memories, target, tally,
            )  # fmt: skip
            return result

        row, within, status, at_once = 1, 0, 0, 64  # steps before the first look at the keyboard
        counted = list(tally)
        try:
            while not status and (row - 1) * every < steps:
                began, length = time.perf_counter(), min(every, steps - (row - 1) * every)
                if within or at_once < length:
                    taken = min(at_once, length - within)
                    status = run(row, 1, taken, more=within + taken < length)
                    within += taken
                    rows = int(within == length and not status)
                else:
                    rows = max(1, min(at_once // every, whole - row + 1))
                    status = run(row, rows, length, more=False)
                    taken = rows * length
                    rows = rows if not status else int((tally[0] - counted[0]) // length)
                if rows:
                    row, within, counted = row + rows, 0, list(tally)
                spent = max(time.perf_counter() - began, 1e-9)
                at_once = max(1, min(2 * at_once, int(taken * _SECONDS_AT_ONCE / spent)))
        except KeyboardInterrupt:
            status = -1
            if within:
                run(row, 1, 0, more=False)
                row, counted = row + 1, list(tally)
        return record[:row], counted[:4], status

    def _too_large(self, method: Method, step: float, state: Array, values: Array) -> str:
        """Return a message if step times the largest frequency at the start (``state``, (2 n,)) exceeds the method's
        limit of stability, else an empty text; also empty for methods without a limit and for more than 100
        coordinates."""
        if not method.stability_limit or self.n > 100:
            return ""
        result = self.largest_frequency(state[: self.n], state[self.n :], values)
        if not abs(step) * result > method.stability_limit:
            return ""
        return (
            f"step times largest frequency is {abs(step) * result:.4g} at the start, and {method.name} is stable up to"
            f" {method.stability_limit:.4g}; try: a step below {0.9 * method.stability_limit / result:.3g}"
        )

    def _values(self, parameters: _Parameters | Array) -> Array:
        """Return the values of all parameters of a run in the file's order: changed by name, the rest by the file and
        formulas there. An array is returned unchanged. Raises UsageError for an unknown name."""
        if isinstance(parameters, np.ndarray):
            return parameters
        changes = _by_name("parameters", "parameter", parameters, list(self.parameters), 'parameters={"m": 2.0}')
        return np.array(list(self.document.parameter_values(changes).values()), float)

    def _start(self, initial: Mapping[str, Any] | None, values: Array) -> Array:
        """Return q and p of the start of a run with the parameters ``values``, (1, 2 n). ``initial`` has coordinates
        and momenta by name, or arrays ``q`` and ``p``. Raises UsageError for unknown names, wrong shapes, and a start
        at which H is not finite."""
        names = [*self.q_names, *self.p_names]
        start_values: Any = initial
        for key, of_array in (("q", self.q_names), ("p", self.p_names)) if isinstance(initial, Mapping) else ():
            if key in start_values and key not in names:
                array = _array(f"initial.{key}", start_values[key])
                if array.shape != (self.n,) or not np.isfinite(array).all():
                    fault = f"{key} has shape {array.shape}, and finite numbers of shape ({self.n},) are needed [E0782]"
                    raise UsageError(Problem("initial", fault, f"one number for each of {', '.join(names[:3])}, ..."))
                rest = {name: value for name, value in start_values.items() if name != key}
                if twice := [name for name in of_array if name in rest]:
                    fault = f"the name {listed(twice)} is given twice, in the array {key} too [E0730]"
                    raise UsageError(Problem("initial", fault, "one of both"))
                start_values = {**dict(zip(of_array, array.tolist(), strict=True)), **rest}
        example = f'initial={{"{self.q_names[0]}": 0.1}}, or "q" and "p" with arrays'
        known = _by_name("initial", "coordinate or momentum", start_values, names, example)
        state = self.document.start(dict(zip(self.parameters, values.tolist(), strict=True)), known)
        energy = float(self._call("hamiltonian", [state[: self.n], state[self.n :]], values)[0].sum())
        if not math.isfinite(energy):
            raise UsageError(Problem("initial", f"H is {energy} at the start [E0784]", NO_START))
        return state[None, :]

    def _call(self, function: str, blocks: list[ArrayLike], parameters: _Parameters | Array) -> list[Array]:
        """Return the outputs of a compiled function at one state (blocks (n,)) or at several (blocks (states, n)). Each
        output has the shape (size,) or (states, size). Raises UsageError for wrong shapes."""
        layout = next(item for item in self.library.layout["functions"] if item["name"] == function)
        arrays = [np.ascontiguousarray(_array(f"{self.name}.{function}", block)) for block in blocks]
        for array in arrays:
            if array.ndim not in (1, 2) or array.shape[-1] != self.n:
                fault = f"an array of a state has shape {array.shape} [E0785]"
                raise UsageError(Problem(f"{self.name}.{function}", fault, f"({self.n},) or (states, {self.n})"))
        count = max((len(array) for array in arrays if array.ndim == 2), default=0)
        outputs = [np.empty((count, item["size"]) if count else item["size"]) for item in layout["outputs"]]
        self.library.call(function, [self._values(parameters), *arrays], outputs)
        return outputs


def _whole_steps(t_end: float, step: float) -> int:
    """Return the number of steps from 0 to ``t_end``. Raises UsageError for a step of 0 or of the wrong sign, and for
    an end that is not a whole number of steps."""
    if not (math.isfinite(t_end) and math.isfinite(step)) or step == 0:
        raise UsageError(Problem("step", f"a finite step other than 0 is needed, not {step:g} [E0787]", "step=0.01"))
    check_step_count("step", t_end, step)
    count = t_end / step
    if count < 0:
        fault = f"steps of {step:g} lead away from {t_end:g} [E0789]"
        raise UsageError(Problem("t_end", fault, f"a step of {-step:g}"))
    steps = round(count)
    if abs(count - steps) > WRITTEN * max(1.0, count * WRITTEN):
        hint = f"an end of {max(steps, 1) * step:.9g}, or a step of {t_end / max(steps, 1):.9g}"
        raise UsageError(Problem("t_end", f"{t_end:.9g} is not a whole number of steps of {step:.9g} [E0790]", hint))
    return steps


def _by_name(argument: str, noun: str, values: object, known: Sequence[str], example: str) -> dict[str, float]:
    """Return the numbers that a caller gives by name; an empty mapping for None. Raises UsageError for another object,
    for names that are not in ``known``, and for values that are not finite numbers."""
    if values is not None and not isinstance(values, Mapping):
        raise UsageError(Problem(argument, f"numbers by name are needed, not {shown(values)} [E0791]", example))
    result = {}
    for name, value in (values or {}).items():
        if name not in known:
            hint = nearest(str(name), known) or f"no {argument}, as there is none"
            raise UsageError(Problem(argument, f"there is no {noun} {shown(str(name))} [E0781]", hint))
        result[name] = _finite(f"{argument}.{name}", value)
    return result


def _array(key: str, value: object) -> Array:
    """Return an array of numbers. Raises UsageError."""
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise UsageError(Problem(key, f"{shown(value)} is not an array of numbers [E0792]", "[0.1, 0.2]")) from None


def _finite(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise UsageError(Problem(key, f"a finite number is needed, not {value!r} [E0343]", "0.1"))
    return float(value)


def _change_of_energy(energy: Mapping[str, Array], method: Method, step: float) -> tuple[str, bool]:
    """Return a warning on the drift of H, empty without one, and whether the drift is so large, ten times the scale at
    the start, that the motion is invalid.

    A drift above 0.3 of the scale is warned of. The scale is the sum of the absolute parts of H, at the same time, at
    the start and in most rows: all parts may be 0 at the start, and an encounter has large parts for a moment.
    """
    total = energy["total"]
    sizes = np.sum([np.abs(part) for name, part in energy.items() if name != "total"], axis=0)
    changes, start = np.abs(total - total[0]), float(sizes[0])
    if not np.any(changes > 0.3 * np.maximum(sizes, max(start, float(np.quantile(sizes, 0.75))))):
        return "", False
    worst = int(np.argmax(changes))
    message = f"H, which nothing changes, goes from {total[0]:.6g} to {total[worst]:.6g}: this is not the motion of the"
    hint = "a smaller tolerance" if method.chooses_steps else f"a step smaller than {abs(step):.3g}, or rk45"
    return f"{message} system; try: {hint}", bool(changes[worst] > 10.0 * start)
