"""The state from which a simulator continues to the same bits: memory, parameters and settings, without the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import ModelError, Problem
from eomgen.toolchain.library import Library


@dataclass(frozen=True, eq=False)
class SimulatorState:
    """The state of a simulator at the end of one of its steps; it can be kept, pickled and restored.

    Attributes
    ----------
    t : s
    q, v, z : (nq,), (nv,), (nz,)
    parameters : (np,)
    u : (nu,) inputs at t that were given to the last step; None if they followed the start or the scene
    begun : state at which the motion starts with its next step; None once it goes on
    memory, workspace : the compiled stepper's, as doubles and as bytes
    settings : of the stepper, in its order
    scene, fingerprint, build : the library that they belong to
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
        """Raise ModelError if the state belongs to another model, method or compilation than a simulator's."""
        hint = "the model, method and compiler that made it, or start(initial={'q': state.q, 'v': state.v})"
        fault = ""
        if self.scene != scene:
            fault = f"this is a state of the scene {self.scene!r}, the simulator runs {scene!r}"
        elif self.fingerprint != library.fingerprint:
            fault = f"this is a state of another model {scene!r}: its scene, terms, method or C code differ"
        elif self.build != library.digest:
            fault = f"this is a state of another compilation of {scene!r}, whose memory may be laid out differently"
        if fault:
            raise ModelError(Problem("state", fault, hint))
