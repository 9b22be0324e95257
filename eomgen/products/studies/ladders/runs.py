"""Runs under given conditions, each in a separate process with a time limit: hangs and crashes are results, too."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
import warnings
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import canonical_name
from eomgen.pipeline.model import Model
from eomgen.results.finding import WARNING
from eomgen.results.solution import Solution

#: Ends of a run: at the end time, before it with a message, refused at the start; interrupted for lack of time; not
#: even interrupted; killed by a signal; with an error that is none of eomgen's.
REACHED, STOPPED, REFUSED, UNFINISHED = "reached", "stopped", "refused", "unfinished"
HANG, CRASH, RAISED = "hang", "crash", "raised"
#: Rows of a run that are compared, and seconds from the interruption of a run to its end.
ROWS, GRACE = 20, 5.0


@dataclass(frozen=True)
class RunConditions:
    """Data of a run besides the method.

    Attributes
    ----------
    model : which of the subject's models
    step : s
    steps : of the run, a multiple of ``ROWS``
    q, v, z : the start; None for the scene's start
    parameters : values of tunable parameters in this run
    start : s
    sizes : divisors of q and v in comparisons: units of this run, (nq,) and (nv,)
    shift : of q, taken off before that
    given : parameters of the method
    """

    model: str
    step: float
    steps: int
    q: Array
    v: Array
    z: Array | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: float = 0.0
    sizes: tuple[Array, Array] | None = None
    shift: Array | None = None
    given: Mapping[str, float] = field(default_factory=dict)

    def vary(self, **changes: Any) -> RunConditions:
        return replace(self, **changes)


@dataclass(frozen=True)
class RunEnding:
    """How a run ended.

    Attributes
    ----------
    how : one of the words above
    said : warnings of the run, or its message if the run did not reach the end
    arrays : of the observation, if the run reached the end
    finite : whether all results are finite
    """

    how: str
    said: str
    arrays: Mapping[str, Array] | None = None
    finite: bool = True
    seconds: float = 0.0


class Request(NamedTuple):
    """A run: conditions, method, and other options of ``simulate``."""

    conditions: RunConditions
    method: str
    more: Mapping[str, Any] = {}


def compile_stepper(model: Model, method: str) -> None:
    """Compile the stepper of a method; faults are reported by the run."""
    with contextlib.suppress(EomgenError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        name = canonical_name(method)
        if name != canonical_name(model.library.layout["built_method"]):
            model.stepper(name)


def run_ending(model: Model, conditions: RunConditions, method: str, **more: Any) -> RunEnding:
    """Simulate a model under the given conditions and return the end of the run; errors of eomgen count as refusals.
    `more` are further options of ``simulate``."""
    initial = {"q": conditions.q, "v": conditions.v}
    initial |= {} if conditions.z is None else {"z": conditions.z}
    options = {name: x for name, x in conditions.given.items() if name not in more}
    end = conditions.start + conditions.step * conditions.steps
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = model.simulate(
                end,
                conditions.step,
                method=method,
                initial=initial,
                parameters=dict(conditions.parameters) or None,
                t_start=conditions.start,
                **{"record_every": max(1, conditions.steps // ROWS), **options, **more},
            )
    except EomgenError as error:
        return RunEnding(REFUSED, str(error))
    if run.interrupted:
        return RunEnding(UNFINISHED, run.message)
    if not run.success:
        return RunEnding(STOPPED, run.message)
    said = "; ".join(str(finding) for finding in run.findings if finding.severity == WARNING)
    every = (run.t, run.q, run.v, run.z, run.a, *run.outputs.values())
    return RunEnding(REACHED, said, _arrays(run, conditions), all(bool(np.all(np.isfinite(x))) for x in every))


def _arrays(run: Solution, conditions: RunConditions) -> dict[str, Array]:
    q, v = run.q, run.v
    if conditions.shift is not None:
        q = q - conditions.shift
    if conditions.sizes is not None:
        q, v = q / conditions.sizes[0], v / conditions.sizes[1]
    of_states = {"z": run.z} if conditions.sizes is None and conditions.shift is None else {}  # else in other units
    return {"t": run.t, "q": q, "v": v, **of_states}


class RunnerProcess:
    """A process that runs one request after another; a lost process is replaced.

    The server is forked at the first request, with all modules loaded so far, and keeps the modules that requests load.
    Compiling has no limit; the limit is for the time after compiling.

    Parameters
    ----------
    prepare : needs of a request before its run, such as compiling
    run : returns the answer to a request

    Attributes
    ----------
    used : whether the process of the last request had answered earlier requests
    compiling : s spent in these
    """

    def __init__(self, prepare: Callable[[Any], None], run: Callable[[Any], RunEnding]) -> None:
        self._prepare, self._run = prepare, run
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self.used, self.compiling = False, 0.0

    def execute(self, request: Any, limit: float) -> RunEnding:
        """Run a request in the process and return its end; a hang or a crash is an end, too, and closes the process.

        Parameters
        ----------
        request : picklable data
        limit : s; then the process is interrupted, and killed without an answer
        """
        pipe, process = self._there()
        began = time.perf_counter()
        try:
            pipe.send(request)
            if not pipe.poll(600.0):
                return self._close_with(RunEnding(HANG, "more than 600 s to compile", seconds=600.0))
            raised: RunEnding | None = pipe.recv()
            self.compiling += time.perf_counter() - began
            if raised is not None:
                return raised
            began = time.perf_counter()
            if pipe.poll(limit):
                ending: RunEnding = replace(pipe.recv(), seconds=time.perf_counter() - began)
                return ending
            os.kill(process.pid or 0, signal.SIGINT)
            if pipe.poll(GRACE):
                return self._close_with(replace(pipe.recv(), seconds=time.perf_counter() - began))
            text = f"more than {limit:g} s, and no answer to an interrupt"
            return self._close_with(RunEnding(HANG, text, seconds=limit))
        except (EOFError, OSError):
            process.join()
            return self._close_with(RunEnding(CRASH, f"killed by signal {-(process.exitcode or 0)}"))

    def close(self) -> None:
        """End the process; the next request gets a new one."""
        if self._process is not None and self._pipe is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
        self._process, self._pipe = None, None

    def _there(self) -> tuple[Connection, BaseProcess]:
        if self._process is None or self._pipe is None:
            fork = multiprocessing.get_context("fork")  # the models are there already
            self._pipe, child_pipe = fork.Pipe()
            self._process = fork.Process(
                target=_serve, args=(child_pipe, self._pipe, self._prepare, self._run), daemon=True
            )
            self._process.start()
            child_pipe.close()
            self.used = False
        else:
            self.used = True
        return self._pipe, self._process

    def _close_with(self, ended: RunEnding) -> RunEnding:
        self.close()
        return ended


def _serve(
    pipe: Connection, parent_pipe: Connection, prepare: Callable[[Any], None], run: Callable[[Any], RunEnding]
) -> None:
    """Answer requests in the child process until the other end of the pipe is closed. After `prepare`, None is sent,
    then the RunEnding of `run`; an exception is sent as a RunEnding, too."""
    parent_pipe.close()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    while True:
        try:
            request = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            return
        try:
            prepare(request)
            pipe.send(None)
            ended = run(request)
        except KeyboardInterrupt:
            ended = RunEnding(UNFINISHED, "interrupted")
        except Exception as error:
            ended = RunEnding(RAISED, f"{type(error).__name__}: {error}")
        pipe.send(ended)
