"""Checkpoints: the complete state of a stepper on disk, from which a run continues bit-identically, and the state of
a simulator, without the model.

State and workspace are kept as they are in memory: the state alone determines the motion up to Newton's tolerance, the
factors and the habits of the iteration in the workspace determine the last bits. So a checkpoint belongs to one
compiled library.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, count_of
from eomgen.base.data import dataclass, field
from eomgen.base.files import read_arrays, write_arrays
from eomgen.base.version import __version__
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import FileError, ModelError, Problem, UsageError
from eomgen.results.error_estimate import array_groups
from eomgen.simulation.stepping.inputs import kind_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library

FORMAT = 1
_KIND = "checkpoint"
_NEEDED = (
    *("scene", "method", "method_parameters", "settings", "parameters", "record_every"),
    *("t_start", "t_end", "inputs", "fingerprint", "selection", "build"),
)


@dataclass(frozen=True)
class Checkpoint:
    """A run at the end of one of its steps.

    Attributes
    ----------
    run : JSON data: scene, method and its parameters, settings, tunable parameters, record_every, t_start and t_end in
        s, kinds of the inputs given by the caller (``number``, ``table`` or ``function``); of the library its
        fingerprint, its functions (a ``Selection``) and its build
    state, workspace : the stepper's memory, as doubles and as bytes
    inputs : values of the inputs that are numbers or tables
    start : the state as t, q, v, z, for a new run from this state
    """

    run: Mapping[str, Any]
    state: Array
    workspace: NDArray[np.uint8]
    inputs: Mapping[str, Array]
    start: Mapping[str, Array] = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write the checkpoint to a file: under a temporary name in the same folder, then renamed. Raises FileError."""
        arrays: dict[str, Any] = {"state": self.state, "workspace": self.workspace}
        arrays |= {f"input.{name}": value for name, value in self.inputs.items()}
        arrays |= {f"start.{name}": value for name, value in self.start.items()}
        write_arrays(path, arrays, {"kind": _KIND, "format": FORMAT, "version": __version__, **self.run})

    @classmethod
    def load(cls, path: Path) -> Checkpoint:
        """Return the checkpoint in a file. Raises FileError if the file cannot be read, is not a checkpoint, is
        incomplete, or has another version of the format."""
        arrays, run = read_arrays(path, _KIND, "a file that simulate(checkpoint=...) wrote")
        wrong, fault = [name for name in _NEEDED if name not in run], ""
        if run.pop("kind", None) != _KIND:
            fault, hint = "this is not a checkpoint written by eomgen [E1992]", "a file of simulate(checkpoint=...)"
        elif run["format"] != FORMAT:
            fault = f"a checkpoint of format {run['format']!r}, written by eomgen {run.get('version')}; this one reads"
            fault, hint = f"{fault} {FORMAT} [E1993]", "the eomgen that wrote it"
        elif wrong or not {"state", "workspace"} <= set(arrays):
            fault = f"this is not a whole checkpoint: {', '.join(wrong) or 'its state'} missing [E1994]"
            hint = "another checkpoint"
        if fault:
            raise FileError(Problem(str(path), fault, hint))
        groups = {"input": {}, "start": {}, **array_groups(arrays)}
        workspace: NDArray[np.uint8] = np.asarray(arrays["workspace"], dtype=np.uint8)
        return cls(run, np.asarray(arrays["state"], dtype=float), workspace, groups["input"], groups["start"])

    def check(self, path: Path, scene: str, library: Library) -> None:
        """Raise ModelError if the checkpoint belongs to another model or to another compilation of this model. `path`
        of the file is named in the error, `scene` is the model's name, and `library` has the stepper that would go
        on."""
        state = f"np.load({path.name!r}) holds start.t, start.q and start.v"
        hint = f"the model that wrote it, or a new run from its state: {state}"
        fault = ""
        if self.run["scene"] != scene:
            fault = f"this checkpoint is one of the scene {self.run['scene']!r}, the model is {scene!r} [E1995]"
        elif self.run["fingerprint"] != library.layout["fingerprint"]:
            fault = f"this checkpoint was written by another model {scene!r}: the scene or eomgen changed [E1996]"
        elif self.run["build"] != library.digest or len(self.state) != library.lib.eomgen_stepper_size(0):
            fault = f"this is a checkpoint of another compilation of {scene!r}, whose last bits may differ [E1997]"
            hint = f"the compiler, flags and machine of the first part; {hint}"
        if fault:
            raise ModelError(Problem(str(path), fault, hint))


def checkpoint_of(run: Run, library: Library, stepper: Stepper) -> Checkpoint:
    """Return a checkpoint of a run at the present state of its stepper, with copies of the stepper's memory. Inputs
    that are functions are noted by name only."""
    inputs = run.signals.given
    values = {name: np.asarray(signal, dtype=float) for name, signal in inputs.items() if not callable(signal)}
    state, workspace = stepper.memory
    run_data = {
        **run.summary,
        "corrections": [sentence.line for sentence in run.corrections],
        "bounded_for": run.bounded_for,
        "inputs": {name: kind_of(signal) for name, signal in inputs.items()},
        "fingerprint": library.layout["fingerprint"],
        "selection": library.layout["selection"],
        "build": library.digest,
    }
    start = {name: state[index] for name, index in stepper.places.items() if name in ("t", "q", "v", "z")}
    return Checkpoint(run_data, state, workspace, values, start)


class CheckpointWriter:
    """Writer of the checkpoints of a run at their due times, to one file that each checkpoint replaces.

    Parameters
    ----------
    path : Path
        The file.
    every : int or None
        Number of steps between two checkpoints; None: one checkpoint a minute.
    describe : callable
        Returns the Checkpoint of a stepper's present state.
    """

    def __init__(self, path: Path, every: int | None, describe: Callable[[Stepper], Checkpoint]) -> None:
        self.path, self.every, self._describe = path, every, describe
        self.problem = ""
        self._last, self._when = -1, time.monotonic()

    def room(self, done: int) -> int | None:
        """Return the number of steps to the next checkpoint; None if checkpoints are written by time."""
        return None if self.every is None else self.every - done % self.every

    def look(self, stepper: Stepper, done: int, *, final: bool = False) -> None:
        """Write a checkpoint of the stepper if one is due after `done` steps, or if `final`. A file that cannot be
        written does not end the run: the reason is kept as ``problem``. No state is written twice."""
        due = time.monotonic() - self._when >= 60.0 if self.every is None else done % self.every == 0
        if done != self._last and (due or final):
            try:
                self.write(stepper, done)
            except FileError as error:
                self.problem = f"no checkpoint was written after {max(self._last, 0)} steps: {error.problems[0]}"

    def write(self, stepper: Stepper, done: int) -> None:
        """Write a checkpoint. Raises FileError."""
        self._describe(stepper).save(self.path)
        self._last, self._when, self.problem = done, time.monotonic(), ""


def checkpoint_writer(
    run: Run, library: Library, path: str | os.PathLike[str] | None, every: int | None
) -> CheckpointWriter | None:
    """Return the writer of the checkpoints of a run to `path`, `every` so many steps; None without a path. Raises
    UsageError for `every` without a path, for anything but a path, and for a wrong number of steps."""
    if path is None:
        if every is not None:
            fault = "there is no file to write to [E1998]"
            raise UsageError(Problem("checkpoint_every", fault, 'checkpoint="run.ckpt"'))
        return None
    if not isinstance(path, str | os.PathLike):
        fault = f"a path is needed, not {type(path).__name__} [E1999]"
        raise UsageError(Problem("checkpoint", fault, 'checkpoint="run.ckpt"'))
    steps = None if every is None else count_of("checkpoint_every", every)
    return CheckpointWriter(Path(path), steps, lambda stepper: checkpoint_of(run, library, stepper))


@dataclass(frozen=True, eq=False)
class SimulatorState:
    """The state of a simulator at the end of a step, which can be kept, pickled and restored.

    Attributes
    ----------
    t : s
    q, v, z : (nq,), (nv,), (nz,)
    parameters : (np,)
    u : (nu,) inputs at t that were given to the last step; None if the inputs followed the start or the scene
    begun : state at which the motion starts with the next step; None after that step
    memory, workspace : the compiled stepper's, as doubles and as bytes
    settings : of the stepper, in the order of the stepper
    scene, fingerprint, build : the library to which the memory belongs
    motions : position, rate and acceleration, (3,), of the motions that the last step ended with, by name
    """

    t: float
    q: Array
    v: Array
    z: Array
    parameters: Array
    u: Array | None
    begun: InitialState | None
    memory: Array
    workspace: NDArray[np.uint8]
    settings: Array
    scene: str
    fingerprint: str
    build: str
    motions: Mapping[str, Array] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<SimulatorState of {self.scene} at t = {self.t:.9g} s>"

    def check(self, scene: str, library: Library) -> None:
        """Raise ModelError if the state belongs to another model, method or compilation than the scene name and library
        given."""
        hint = "the model, method and compiler that made it, or start(initial={'q': state.q, 'v': state.v})"
        fault = ""
        if self.scene != scene:
            fault = f"this is a state of the scene {self.scene!r}, the simulator runs {scene!r} [E2000]"
        elif self.fingerprint != library.fingerprint:
            fault = f"this is a state of another model {scene!r}: its scene, terms, method or C code differ [E2001]"
        elif self.build != library.digest:
            fault = f"this is a state of another compilation of {scene!r}, whose memory may differ [E2002]"
        if fault:
            raise ModelError(Problem("state", fault, hint))
