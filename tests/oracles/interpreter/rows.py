"""Constraint rows: (quantity of a motion, whether it is holonomic)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tests.oracles.interpreter import jets
from tests.oracles.interpreter.jets import Jet, cross, dot, jet, rotated
from tests.oracles.interpreter.machine import Motion, Pose

if TYPE_CHECKING:
    from tests.oracles.interpreter.equations import State

Array = NDArray[Any]
Data = Mapping[str, Any]


def row_functions(state: State) -> Iterator[tuple[Any, bool]]:
    for name, joint in state.machine.joints.items():
        drives = joint.get("drive")
        if drives is not None:
            for k, law in enumerate(drives if isinstance(drives, list) else [drives]):
                yield (lambda s, n=name, i=k, f=law: s.coordinates[n][i] - state._of_time(f, s)), True
    for entry in state.data.get("constraints", {}).values():
        yield from constraint_rows(state, entry)


def constraint_rows(state: State, entry: Data) -> Iterator[tuple[Any, bool]]:
    kind = entry["type"]

    def relative(s: Motion) -> tuple[Jet, Jet]:
        first, second = state.frame(entry["first"], s), state.frame(entry["second"], s)
        T = first.R.transposed()
        return T @ second.R, rotated(T, second.x - first.x)

    def R(i: int, j: int) -> Any:
        return (lambda s: relative(s)[0][..., i, j]), True

    def x(i: int) -> Any:
        return (lambda s: relative(s)[1][..., i]), True

    if kind in ("spherical", "revolute", "universal", "fixed"):
        yield from (x(0), x(1), x(2))
    if kind in ("cylindrical", "helical", "prismatic", "point_on_line"):
        yield from (x(0), x(1))
    if kind in ("revolute", "cylindrical", "helical", "prismatic", "planar", "fixed"):
        yield from (R(0, 2), R(1, 2))
    if kind == "planar":
        yield x(2)
    if kind in ("prismatic", "fixed"):
        yield R(0, 1)
    if kind == "universal":
        yield R(0, 1)
    if kind == "helical":
        pitch = state.machine.value(entry["pitch"])

        def screw(s: Motion) -> Jet:
            turn, place = relative(s)
            return place[..., 2] - pitch * jets.atan2(turn[..., 1, 0], turn[..., 0, 0])

        yield screw, True
    if kind == "distance":
        yield (lambda s: jets.sqrt(dot(relative(s)[1], relative(s)[1])) - state._of_time(entry["length"], s)), True
    if "drive" in entry:
        if kind == "revolute":

            def angle(s: Motion) -> Jet:
                turn = relative(s)[0]
                return jets.atan2(turn[..., 1, 0], turn[..., 0, 0]) - state._of_time(entry["drive"], s)

            yield angle, True
        else:
            yield (lambda s: relative(s)[1][..., 2] - state._of_time(entry["drive"], s)), True
    if kind == "rolling":
        yield from rolling(state, entry, relative)


def rolling(state: State, entry: Data, relative: Any) -> Iterator[tuple[Any, bool]]:
    radius, disc = state.machine.value(entry["radius"]), entry.get("shape", "disc") == "disc"

    def arm(s: Motion) -> Jet:
        """From the centre to the contact, in the first frame."""
        axis = relative(s)[0][..., :, 2]
        down = np.array([0.0, 0.0, -1.0])
        if not disc:
            return jet(np.broadcast_to(radius * down, axis.value.shape))
        across = down - axis * (-axis[..., 2])[..., None]
        return across * (radius / jets.sqrt(dot(across, across)))[..., None]

    def slide(s: Motion, component: int) -> Jet:
        turn, place = relative(s)
        material = place.derivative + cross(Pose(turn, place).omega, arm(s))
        return material[..., component]

    yield (lambda s: relative(s)[1][..., 2] + arm(s)[..., 2]), True
    yield (lambda s: slide(s, 0)), False
    yield (lambda s: slide(s, 1)), False
