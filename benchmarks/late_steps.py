"""How late single steps are, and how much of that is the machine's: every step timed in C, in turns with an empty loop
of the same length.

The same run is repeated. What all of its repetitions have in common is the method's: the median of each step over the
repetitions. What a step has once, and the empty loop as well, is the machine's: interrupts, and others on its core.
"""

from __future__ import annotations

import ctypes
import functools
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.programs import FLAGS, NATIVE, build, default_folder
from eomgen.integrators.families.register import method_named
from eomgen.simulation.timing import RepeatedRun

Array = NDArray[np.float64]
PART, BEYOND = 0.9999, 1.3
#: Of repetitions: how many, behind one that warms caches; s of rest between two, since Linux keeps 5 % of a core for
#: others than real-time threads.
REPETITIONS, REST, WARMING = 11, 0.15, 100
_DECLARED = """
uint64_t late_ticks(void);
int late_steps(uintptr_t run, const double *p, const double *settings, double *state, double *workspace, long count,
               const double *inputs, long row, long turns, uint32_t *stepped, uint32_t *empty);
"""


@dataclass(frozen=True)
class Lateness:
    """Times of steps, all but the first ``WARMING`` of each repetition, which fill caches.

    Attributes
    ----------
    stepped, empty : (repetitions, steps), ns, of steps and of empty loops
    """

    stepped: Array
    empty: Array

    @property
    def kinds(self) -> dict[str, Array]:
        """All steps, all empty loops, and the median of each step over the repetitions, ns."""
        return {
            "steps": self.stepped.ravel(),
            "empty loops": self.empty.ravel(),
            "each step's median": np.median(self.stepped, axis=0),
        }

    def summary(self) -> dict[str, dict[str, float]]:
        """Return median, late and longest time of each kind, us, and the part beyond ``BEYOND`` medians."""
        found = {}
        for name, ns in self.kinds.items():
            late = float(np.quantile(ns, PART, method="higher"))
            median = float(np.median(ns))
            found[name] = {"median": median / 1e3, "late": late / 1e3, "longest": float(ns.max()) / 1e3}
            found[name] |= {"late_by_median": late / median, "beyond": float(np.mean(ns > BEYOND * median))}
        return found

    def histograms(self) -> dict[str, dict[str, int]]:
        """Return how many times of each kind there are of so many ns."""
        found = {}
        for name, ns in self.kinds.items():
            values, counts = np.unique(np.round(ns).astype(int), return_counts=True)
            found[name] = {str(value): int(count) for value, count in zip(values, counts, strict=True)}
        return found


@functools.cache
def _library() -> tuple[cffi.FFI, Any]:
    files = {"late_steps.c": (NATIVE / "late_steps.c").read_text(encoding="utf-8")}
    made = build(default_folder(), files, [["gcc", *FLAGS["fast"], "-shared", "-fPIC", *files, "-o", "late.so"]])
    ffi = cffi.FFI()
    ffi.cdef(_DECLARED)
    return ffi, ffi.dlopen(str(made.file("late.so")))


class LateSteps(RepeatedRun):
    """A run to be repeated, each step timed."""

    def lateness(self, repetitions: int = REPETITIONS) -> Lateness:
        """Repeat the run once more than ``repetitions``, and return the times of all but the first. Raises
        NumericalError where it stops."""
        turns, found = 1000, []
        for number in range(1 + repetitions):
            with isolated():
                ticks = self._once(turns)
            time.sleep(REST)
            if number:
                found.append(ticks)
            else:
                turns = max(1, round(turns * float(np.median(ticks[0]) / np.median(ticks[1]))))
        stepped, empty = np.array(found).transpose(1, 0, 2) * _ns_per_tick()
        return Lateness(stepped[:, WARMING:], empty[:, WARMING:])

    def _once(self, turns: int) -> tuple[Array, Array]:
        ffi, library = _library()
        stepper, table = self._stepper, self._table
        stepped, empty = (np.zeros(self.steps, dtype=np.uint32) for _ in range(2))
        row = 0 if table is None else stepper.sizes["rows_per_step"] * table.shape[1]
        address = int(stepper.library.ffi.cast("uintptr_t", _run_of(stepper.library)))
        memory = (stepper.parameters, stepper.settings, stepper.state, stepper.workspace)
        self._begin()
        status = library.late_steps(
            address,
            *(ffi.from_buffer("double[]", part) for part in memory),
            self.steps,
            ffi.NULL if table is None else ffi.from_buffer("double[]", table),
            row,
            turns,
            *(ffi.from_buffer("uint32_t[]", part) for part in (stepped, empty)),
        )
        self._check(status)
        return stepped, empty


def _run_of(library: Any) -> Any:
    return library.ffi.addressof(library.lib, "eomgen_run")


@functools.cache
def _ns_per_tick() -> float:
    _, library = _library()
    times, ticks = [], []
    for _ in range(2):
        times.append(time.monotonic_ns())
        ticks.append(library.late_ticks())
        time.sleep(0.3)
    return (times[1] - times[0]) / (ticks[1] - ticks[0])


def late_steps(model: eomgen.Model, method: str, step: float, steps: int, repetitions: int = REPETITIONS) -> Lateness:
    """Return the times of steps of a method from the model's initial state."""
    solution = model.simulate(steps * step, step, method=method, record_every=steps, error_estimate=False)
    return LateSteps(model, solution, method_named(method)).lateness(repetitions)


def isolation() -> str:
    """Return what the system grants for the steps to be undisturbed."""
    granted = []
    with isolated() as means:
        granted += means
    return ", ".join(granted) or "nothing"


@contextmanager
def isolated() -> Iterator[list[str]]:
    """Run as real-time thread on the core that this process is on, all memory held, as far as that is allowed; give
    what was."""
    means = []
    system = ctypes.CDLL(None)
    if system.mlockall(3) == 0:  # now and in future
        means.append("memory locked")
    if hasattr(os, "sched_getaffinity") and len(os.sched_getaffinity(0)) == 1:
        means.append("one core")
    before = None
    if hasattr(os, "SCHED_FIFO"):
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
            means.append("real-time thread (SCHED_FIFO)")
        except PermissionError:
            before = None
    try:
        yield means
    finally:
        system.munlockall()
        if before is not None:
            os.sched_setscheduler(0, *before)


def draw(found: Mapping[str, Lateness], file: Path) -> None:
    """Draw for each run which part of the steps takes longer than so many medians."""
    from matplotlib.figure import Figure  # noqa: PLC0415  # only where it is asked for

    figure = Figure(figsize=(3.6 * len(found), 3.4), layout="constrained")
    for axes, (title, lateness) in zip(
        figure.subplots(1, len(found), sharey=True, squeeze=False)[0], found.items(), strict=True
    ):
        for name, ns in lateness.kinds.items():
            ordered = np.sort(ns) / np.median(ns)
            axes.plot(ordered, 1.0 - np.arange(len(ns)) / len(ns), drawstyle="steps-post", label=name)
        axes.axhline(1.0 - PART, color="0.6", linewidth=0.8, linestyle=":")
        axes.axvline(BEYOND, color="0.6", linewidth=0.8, linestyle=":")
        axes.set(xscale="log", yscale="log", title=title, xlabel="time by median", xlim=(0.5, None))
        axes.legend(frameon=False, fontsize=8, loc="upper right")
    figure.axes[0].set_ylabel("part of the steps that takes longer")
    figure.savefig(file)
