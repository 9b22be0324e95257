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
    """Runs requests, each in a process of its own, forked with the models and modules that are there.

    Compiling has no limit; the limit is for the time after compiling.

    Parameters
    ----------
    prepare : needs of a request before its run, such as compiling, which stay for later requests
    run : returns the answer to a request

    Attributes
    ----------
    compiling : s spent in ``prepare``
    """

    def __init__(self, prepare: Callable[[Any], None], run: Callable[[Any], RunEnding]) -> None:
        self._prepare, self._run = prepare, run
        self.compiling = 0.0

    def execute(self, request: Any, limit: float) -> RunEnding:
        """Run a request in a process and return its end; a hang or a crash is an end, too. After ``limit``, in s, the
        process is interrupted, and killed if it does not answer."""
        began = time.perf_counter()
        try:
            self._prepare(request)
        except Exception as error:
            return _raised(error)
        self.compiling += time.perf_counter() - began
        fork = multiprocessing.get_context("fork")  # the models are there already
        pipe, child_pipe = fork.Pipe(duplex=False)
        process = fork.Process(target=_answer, args=(child_pipe, self._run, request), daemon=True)
        process.start()
        child_pipe.close()
        began = time.perf_counter()
        try:
            if not pipe.poll(limit):
                os.kill(process.pid or 0, signal.SIGINT)
                if not pipe.poll(GRACE):
                    return RunEnding(HANG, f"more than {limit:g} s, and no answer to an interrupt", seconds=limit)
            return replace(pipe.recv(), seconds=time.perf_counter() - began)
        except EOFError:
            process.join()
            return RunEnding(CRASH, f"killed by signal {-(process.exitcode or 0)}")
        finally:
            process.kill()
            process.join()
            pipe.close()


def _answer(pipe: Connection, run: Callable[[Any], RunEnding], request: Any) -> None:
    """Send the end of a run from the child process; an exception is an end, too."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        ended = run(request)
    except KeyboardInterrupt:
        ended = RunEnding(UNFINISHED, "interrupted")
    except Exception as error:
        ended = _raised(error)
    pipe.send(ended)


def _raised(error: Exception) -> RunEnding:
    return RunEnding(RAISED, f"{type(error).__name__}: {error}")
