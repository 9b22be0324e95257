"""One run under given conditions, in a child process with a time limit: hangs and crashes are results, too."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import EomgenError
from eomgen.model import Model
from eomgen.results.solution import Solution

#: How a run may end: at its end, before it with a message, refused before it; interrupted when its time was over; not
#: even that; killed by a signal; with an error that is none of eomgen's.
REACHED, STOPPED, REFUSED, UNFINISHED = "reached", "stopped", "refused", "unfinished"
HANG, CRASH, RAISED = "hang", "crash", "raised"
#: Rows of a run that are compared, and seconds that a run has to stop when it is interrupted.
ROWS, GRACE = 20, 5.0


@dataclass(frozen=True)
class Conditions:
    """All that decides a run but its method.

    Attributes
    ----------
    model : which of the subject's models
    step : s
    steps : of the run, a multiple of ``ROWS``
    q, v, z : the start; the scene's where they are None
    parameters : of this run, tunable ones
    start : s
    sizes : what q and v are divided by where they are compared: units of this run, (nq,) and (nv,)
    shift : of q, taken off before that
    given : parameters of the method
    """

    model: str
    step: float
    steps: int
    q: Array | None = None
    v: Array | None = None
    z: Array | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: float = 0.0
    sizes: tuple[Array, Array] | None = None
    shift: Array | None = None
    given: Mapping[str, float] = field(default_factory=dict)

    def varied(self, **changes: Any) -> Conditions:
        return replace(self, **changes)


@dataclass(frozen=True)
class Ended:
    """How a run ended.

    Attributes
    ----------
    how : one of the words above
    said : what it said besides that it reached its end
    arrays : of its observation, where it reached its end
    finite : whether all that it gave is finite
    """

    how: str
    said: str
    arrays: Mapping[str, Array] | None = None
    finite: bool = True
    seconds: float = 0.0


def simulated(model: Model, conditions: Conditions, method: str, **more: Any) -> Ended:
    """Return how a run under these conditions ends."""
    initial = None
    if conditions.q is not None and conditions.v is not None:
        initial = {"q": conditions.q, "v": conditions.v}
        if conditions.z is not None:
            initial["z"] = conditions.z
    given = {name: x for name, x in conditions.given.items() if name not in more}
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
                **{"record_every": max(1, conditions.steps // ROWS), **given, **more},
            )
    except EomgenError as error:
        return Ended(REFUSED, str(error))
    if run.interrupted:
        return Ended(UNFINISHED, run.message)
    said = run.message.partition("; ")[2] if run.success else run.message
    if not run.success:
        return Ended(STOPPED, said)
    every = (run.t, run.q, run.v, run.z, run.a, *run.outputs.values())
    return Ended(REACHED, said, _arrays(run, conditions), all(bool(np.all(np.isfinite(x))) for x in every))


def _arrays(run: Solution, conditions: Conditions) -> dict[str, Array]:
    q, v = run.q, run.v
    if conditions.shift is not None:
        q = q - conditions.shift
    if conditions.sizes is not None:
        q, v = q / conditions.sizes[0], v / conditions.sizes[1]
    return {
        "t": run.t,
        "q": q,
        "v": v,
    }


def in_child(call: Callable[[], Ended], limit: float) -> Ended:
    """Return what a call gives in a child process.

    Parameters
    ----------
    limit : s; then the child is interrupted, and killed when it does not end
    """
    began = time.perf_counter()
    fork = multiprocessing.get_context("fork")  # the models are there already
    answers, sender = fork.Pipe(duplex=False)
    child = fork.Process(target=_answer, args=(call, sender), daemon=True)
    child.start()
    sender.close()
    data = b""
    try:
        there = answers.poll(limit)
        if not there and child.pid is not None:
            os.kill(child.pid, signal.SIGINT)
            there = answers.poll(GRACE)
        if not there:
            child.kill()
            return Ended(HANG, f"more than {limit:g} s, and no answer to an interrupt", seconds=limit)
        data = answers.recv_bytes()
    except EOFError:
        pass
    finally:
        child.join()
        answers.close()
    took = time.perf_counter() - began
    if not data:
        return Ended(CRASH, f"killed by signal {-(child.exitcode or 0)}", seconds=took)
    return _read(data, took)


def _answer(call: Callable[[], Ended], sender: Connection) -> None:
    """Call in the child, and send the answer."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        ended = call()
    except KeyboardInterrupt:
        ended = Ended(UNFINISHED, "interrupted")
    except Exception as error:
        ended = Ended(RAISED, f"{type(error).__name__}: {error}")
    arrays = {name: array.tolist() for name, array in (ended.arrays or {}).items()}
    content = [ended.how, ended.said, arrays if ended.arrays is not None else None, ended.finite]
    sender.send_bytes(json.dumps(content).encode())


def _read(data: bytes, seconds: float) -> Ended:
    how, said, arrays, finite = json.loads(data)
    rows = None if arrays is None else {name: np.array(array, dtype=float) for name, array in arrays.items()}
    return Ended(how, said, rows, finite, seconds)
