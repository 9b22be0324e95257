"""A scene beside one whose numbers are moved by a little: all that is computed of both, and by how much it may
differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.symbolic.evaluate import evaluate
from tests.oracles.evaluation import Array
from tests.oracles.states import random_states
from tests.oracles.written_scenes import Data, Place, shifted, structure

TERMS = (
    "mass",
    "coupling",
    "force",
    "base_motion",
    "inverse_dynamics",
    "forward_dynamics",
    "residual",
    "partials",
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "poses",
    "twists",
    "accelerations",
    "jacobians",
    "elastic",
    "outputs",
    "energy",
)

SHIFTS = (1e-13, 1e-11, 9e-11, 1.1e-10, 3e-10, 1e-9, 3e-9, 1e-8, 1.5e-8, 3e-8, 1e-7)
AXES = ("axis", "x_axis", "second_axis", "orientation")
BLUR, STEP, SAFETY, ROUNDING, LEAST = 1e-3, 1e-6, 100.0, 1e-14, 0.01


def computed(data: Data, seed: int, terms: Sequence[str] = TERMS) -> dict[str, Array]:
    """Return all that the equations of a scene give at two random states, and its initial state, by function and
    block."""
    system = derive(from_data(data), terms)
    rng = np.random.default_rng(seed)
    state = random_states(system, 2, rng)
    state |= {
        name: rng.normal(size=(2, size)) for name, size in (("lam", len(system.multipliers)), ("z", system.nz)) if size
    }
    if "base" in system.functions:
        state["base"] = evaluate(system.tape, system.functions["base"].refs, state)
    found: dict[str, Array] = {"initial state": np.array([*system.initial_q, *system.initial_v])}
    places, refs = list[tuple[str, int]](), list[int]()
    for function in system.functions.values():
        for block in function.outputs:
            places.append((f"{function.name}.{block.name}", len(block.refs)))
            refs += block.refs
    values = evaluate(system.tape, refs, state)
    start = 0
    for name, size in places:
        found[name], start = values[:, start : start + size], start + size
    return found


def change(before: dict[str, Array], after: dict[str, Array]) -> dict[str, float]:
    """Return the largest change in each block."""
    assert {name: block.shape for name, block in before.items()} == {name: block.shape for name, block in after.items()}
    return {name: float(np.max(np.abs(after[name] - block), initial=0.0)) for name, block in before.items()}


class Compared:
    """One scene, and how much each of its functions may change.

    The *condition* of a function is the change of its largest entry by the change of the scene's numbers, measured at a
    scene nearby where nothing is structure any more: all numbers moved at random by 1e-3. So nothing that the code does
    about zeros, ones and coordinate axes enters it. Where that is less than the function's own size, the size is taken,
    and 0.01 at least, for what cancels: the numbers of the scenes are of order one. A shift of eps may change a
    function by 100 times eps times its condition: 100 for what the condition differs between the two scenes and along
    directions that were not tried. Rounding counts as a shift of 1e-14. What mistakes structure, by contrast, changes a
    function by its own size, 1e5 times the bound at 1e-7 and 1e9 times at 1e-11.
    """

    def __init__(self, data: Data, seed: int) -> None:
        self.data, self.seed, self.rng = data, seed, np.random.default_rng(seed)
        self.vectors = structure(data)
        self.values = computed(data, seed)
        nearby = self._nearby()
        there = computed(nearby, seed)
        every = [place for vector in self.vectors for place in vector]
        self.condition = {name: float(np.max(np.abs(block), initial=LEAST)) for name, block in self.values.items()}
        for _ in range(2):
            moved = computed(shifted(nearby, {place: STEP * self.rng.choice([-1.0, 1.0]) for place in every}), seed)
            for name, size in change(there, moved).items():
                self.condition[name] = max(self.condition[name], size / STEP)

    def _nearby(self) -> Data:
        every = [place for vector in self.vectors for place in vector]
        for _ in range(40):  # a place on a beam may be moved beyond its end
            nearby = shifted(self.data, {place: BLUR * self.rng.uniform(-1.0, 1.0) for place in every})
            try:
                from_data(nearby)
            except DescriptionError:
                continue
            return nearby
        raise AssertionError(f"no scene near {self.data}")

    def amounts(self) -> dict[Place, float]:
        """Return what to shift, by one of ``SHIFTS``: most often an axis or one of its components, else any numbers."""
        shift, kind = float(self.rng.choice(SHIFTS)), self.rng.integers(4)
        if kind == 3:
            chosen = [place for places in self.vectors for place in places if self.rng.uniform() < 0.3]
        else:
            axes = [places for places in self.vectors if places[0][-2] in AXES]
            among = axes if axes and kind < 2 else self.vectors
            chosen = among[self.rng.integers(len(among))]
            if self.rng.uniform() < 0.5:
                chosen = [chosen[self.rng.integers(len(chosen))]]
        return {place: shift * float(self.rng.choice([-1.0, 1.0, 0.5])) for place in chosen}

    def excess(self, amounts: dict[Place, float]) -> dict[str, float]:
        """Return the functions that a shift changes by more than it may, with how many times more."""
        allowed = SAFETY * (max(map(abs, amounts.values())) + ROUNDING)
        moved = change(self.values, computed(shifted(self.data, amounts), self.seed))
        return {
            name: size / (allowed * self.condition[name])
            for name, size in moved.items()
            if size > allowed * self.condition[name]
        }
