"""Programs of nets and chains: scenes with many equal rows of bodies in absolute coordinates, free or on joints, or in
joint coordinates, continued from scenes with few rows.

Rows are numbered by integers in the names of bodies, points and force elements, as ``[repeat]`` makes them. Three
scenes with fewer rows are derived, and ``codegen.continuation`` checks that their Programs grow evenly. That all rows
of the given scene are equal is checked here: apart from the state at the start, numbers of a row are the same in all
rows, or grow evenly.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from functools import cache, cached_property, partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, fields, is_dataclass, replace
from eomgen.codegen.continuation import IrregularSamples, Samples, continued_sums
from eomgen.codegen.program import Program
from eomgen.formula.nodes import ZERO, Number
from eomgen.mechanics.initial_coordinates import AbsoluteStartEquations, free_start, joint_start
from eomgen.mechanics.scene_tape import Derivation
from eomgen.pipeline.equal_elements import Derived, continue_samples
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.system import Sample
from eomgen.system.terms import TERMS

#: The parts of a name between its numbers, and the numbers.
Parts = tuple[tuple[str, ...], tuple[int, ...]]
#: Bodies from which on three scenes with few rows are derived faster; least bodies and rows of the smallest of them,
#: and rows more of the next one.
MANY = 800
_FEW, _FEW_ROWS, _MORE = 100, 10, 2
#: The same with joints, rows in place of bodies: the first of them have pivots of their own.
MANY_JOINED, _FEW_JOINED, _MORE_JOINED = 100, 18, 1
#: The same in joint coordinates, with least velocities of the smallest scene: shorter chains have functions without
#: loops, and loops of some lengths begin elsewhere, so that other lengths are tried.
MANY_HINGED, _FEW_HINGED, _MORE_HINGED, _FREEDOMS = 300, 28, 4, 60
#: Rows at the end of a scene that may differ from the others, as rows at its beginning may.
_END = 3
#: Largest deviation of numbers that grow evenly, as a part of the largest.
_EVEN = 1e-9
_INTEGER = re.compile(r"(\d+)")
#: Parts of a scene that may have entries.
_LISTS = ("bodies", "joints", "points", "elements")
_PLAIN = frozenset({*_LISTS, "name", "gravity", "description", "parameters", "shapes", "coordinates", "groups"}) | {
    "simulation", "terms", "parts", "requirements", "source", "content", "notes", "metadata",
}  # fmt: skip  # a list
#: Terms of a long scene with joints.
_LINEAR = (*(term.name for term in TERMS.values() if not term.on_request and not term.quadratic), "mass_values")
#: Fields that no equation of free bodies follows from but the state at the start.
_START = frozenset({"initial_position", "initial_velocity"})


def equal_rows(scene: Scene) -> EqualRows | None:
    """Return the rows of a scene of many bodies in equal numbered rows; None if such rows are not found. None also if
    rows differ, are few, or if the scene has other parts than bodies, joints, points, force elements and parameters;
    scenes with joints other than free ones must be plain chains."""
    hinged = scene.coordinates == "joint"
    joined = any(joint.type != "free" for joint in scene.joints)
    if len(scene.bodies) < (MANY_HINGED if hinged else MANY_JOINED if joined else MANY):
        return None
    if (joined or hinged) and not _is_plain_chain(scene, hinged):
        return None
    if any(scene.parts.values()) or any(getattr(scene, item.name) for item in fields(scene) if item.name not in _PLAIN):
        return None
    names = [item.name for part in _LISTS for item in getattr(scene, part)]
    if len(set(names)) < len(scene.bodies) or not names:
        return None
    rows = _find_rows(names)
    if rows is None:
        return None
    made = EqualRows(scene, *rows, joined)
    return made if made.regular else None


def _is_plain_chain(scene: Scene, hinged: bool) -> bool:
    """Return whether a scene has no force elements, no drives or mimic relations, and no wanted term that is a whole
    matrix. In absolute coordinates (not ``hinged``) joints must not have springs, stops or friction either: forces are
    recorded one by one, so their loops grow unevenly."""
    whole = any(TERMS[name].quadratic for name in scene.terms if name in TERMS)
    simple = _moves_freely if hinged else _only_connects
    return not whole and not scene.elements and all(map(simple, scene.joints))


def _moves_freely(joint: Joint) -> bool:
    """Return whether a joint has neither a drive nor a mimic relation."""
    return not (joint.drive or joint.mimic)


def _only_connects(joint: Joint) -> bool:
    """Return whether a joint has no springs, stops, friction or motions of its own."""
    has_forces_or_motion = joint.stops or joint.friction or not _moves_freely(joint)
    return not has_forces_or_motion and joint.stiffness == joint.damping == ZERO


def _find_rows(names: Sequence[str]) -> tuple[Mapping[tuple[str, ...], int], int, int] | None:
    """Return the position of the row's number among the integers in a name, and the first and the last row. Positions
    are by the other parts of the name. None if no integer counts many rows, or if two of a name may."""
    numbers: dict[tuple[str, ...], list[tuple[int, ...]]] = {}
    for name in dict.fromkeys(names):
        shape, integers = parts_of(name)
        numbers.setdefault(shape, []).append(integers)
    columns = {shape: np.array(rows).reshape(len(rows), -1) for shape, rows in numbers.items()}
    last = max((int(table.max()) for table in columns.values() if table.size), default=0)
    places: dict[tuple[str, ...], int] = {}
    first = last
    for shape, table in columns.items():
        near = [column for column in range(table.shape[1]) if last - int(table[:, column].max()) <= 1]
        if len(near) > 1:
            return None
        if near and len(np.unique(table[:, near[0]])) >= last - _END:
            places[shape] = near[0]
            first = min(first, int(table[:, near[0]].min()))
    return (places, first, last) if places and first <= 1 else None


_KNOWN: dict[str, Parts] = {}


def parts_of(name: str) -> Parts:
    """Return the parts of a name between its integers, ``""`` for each integer, and the integers; ``07`` does not
    count."""
    if name not in _KNOWN:
        pieces = _INTEGER.split(name)
        numbers = []
        for index in range(1, len(pieces), 2):
            if str(int(pieces[index])) == pieces[index]:
                numbers.append(int(pieces[index]))
                pieces[index] = ""
        _KNOWN[name] = tuple(pieces), tuple(numbers)
    return _KNOWN[name]


@dataclass(frozen=True)
class _Row:
    """A body, joint, point or force element of a scene: place in the list, data without numbers, and numbers."""

    place: int
    data: object
    numbers: tuple[float, ...]

    def is_like(self, other: _Row, grows: NDArray[np.bool_]) -> bool:
        """Return whether two entries differ at most in numbers that grow."""
        if self.data != other.data:
            return False
        return all(a == b for a, b, free in zip(self.numbers, other.numbers, grows, strict=True) if not free)


@dataclass(frozen=True)
class EqualRows:
    """A scene with equal rows of bodies, numbered in names, whose Program is continued from scenes with fewer rows.

    Attributes
    ----------
    places : which integer in a name is the number of the row, by the other parts of the name
    first, last : rows
    joined : whether bodies have other joints than free ones
    """

    scene: Scene
    places: Mapping[tuple[str, ...], int]
    first: int
    last: int
    joined: bool

    @property
    def count(self) -> int:
        return self.last - self.first + 1

    @property
    def is_hinged(self) -> bool:
        """Whether the scene is in joint coordinates."""
        return self.scene.coordinates == "joint"

    @property
    def inner(self) -> range:
        """The rows that must be equal."""
        return range(self.first + _END, self.last - _END + 1)

    def row_of(self, name: str) -> int | None:
        """Return the row's number of a body, joint, point or force element by name, None outside of rows."""
        shape, numbers = parts_of(name)
        index = self.places.get(shape)
        return None if index is None else numbers[index]

    def name_before(self, name: str, rows: int) -> str:
        """Return a name with the row's number reduced by ``rows``; unchanged without a row."""
        shape, numbers = parts_of(name)
        index = self.places.get(shape)
        if index is None:
            return name
        pieces = list(shape)
        texts = iter(number - rows if k == index else number for k, number in enumerate(numbers))
        pieces[1::2] = [piece or str(next(texts)) for piece in pieces[1::2]]
        return "".join(pieces)

    def _kind(self, item: Any, row: int) -> object:
        return type(item), self.name_before(item.name, row)

    @cached_property
    def entries(self) -> dict[str, dict[object, dict[int, _Row]]]:
        """Bodies, joints, points and force elements in rows: by list, by kind (type, name without row) and by row."""
        result: dict[str, dict[object, dict[int, _Row]]] = {}
        for part in _LISTS:
            kinds = result.setdefault(part, {})
            for index, item in enumerate(getattr(self.scene, part)):
                row = self.row_of(item.name)
                if row is not None:
                    numbers: list[float] = []
                    data = self._data(item, row, numbers)
                    kinds.setdefault(self._kind(item, row), {})[row] = _Row(index, data, tuple(numbers))
        return result

    def _data(self, value: Any, row: int, numbers: list[float]) -> object:
        """Return nested data that are equal for equal parts of two rows, and append all numbers to ``numbers``. Numbers
        are replaced by the type, and rows in names are relative to ``row``."""
        kind = type(value)
        if kind is float:
            numbers.append(value)
            return float
        if kind is Number:  # most of all data
            numbers.append(value.value)
            return Number
        if kind is str:
            shape, integers = parts_of(value)
            index = self.places.get(shape)
            return value if index is None else (shape, integers[:index], integers[index] - row, integers[index + 1 :])
        if kind is tuple or kind is list:
            return tuple([self._data(item, row, numbers) for item in value])
        names = _names(cast("Hashable", kind))
        return (kind, *[self._data(getattr(value, name), row, numbers) for name in names]) if names else value

    @cached_property
    def regular(self) -> bool:
        """Whether the rows can be continued: enough rows, equal inside and in even order, few other parts."""
        if self.count < (MANY_HINGED if self.is_hinged else MANY_JOINED if self.joined else 4 * _END + 2 * _FEW_ROWS):
            return False
        if not self.joined and not self.is_hinged and free_start(self.scene) is None:
            return False
        few = len(self.scene.bodies) // self.count
        for part, kinds in self.entries.items():
            if len(getattr(self.scene, part)) - sum(map(len, kinds.values())) > few:
                return False
            if not all(map(self._is_regular, kinds.values())):
                return False
        return bool(self.entries["bodies"])

    def _is_regular(self, rows: Mapping[int, _Row]) -> bool:
        inner = [rows.get(row) for row in self.inner]
        if None in inner:
            return not any(inner)
        kept = cast("list[_Row]", inner)
        if any(_reach(row.data) >= _END for row in kept[:1]) or any(row.data != kept[0].data for row in kept):
            return False
        places = np.array([row.place for row in kept])
        if np.any(np.diff(places, 2)):
            return False
        table = np.array([row.numbers for row in kept]).reshape(len(kept), -1)
        growth = np.ptp(table, axis=0) > 0.0
        return all(_is_even(column) for column in table.T[growth])

    def _grows(self, rows: Mapping[int, _Row]) -> NDArray[np.bool_]:
        """Return a flag for each number of the entries of a kind: whether it grows from row to row."""
        return self._flags[id(rows)]

    @cached_property
    def _flags(self) -> dict[int, NDArray[np.bool_]]:
        """The same by the identity of entries, which stay alive."""
        return {id(rows): self._growth(rows) for kinds in self.entries.values() for rows in kinds.values()}

    def _growth(self, rows: Mapping[int, _Row]) -> NDArray[np.bool_]:
        inner = [rows[row].numbers for row in self.inner if row in rows]
        if not inner:
            return np.zeros(len(next(iter(rows.values())).numbers), dtype=bool)
        return np.asarray(np.ptp(np.array(inner).reshape(len(inner), -1), axis=0) > 0.0)

    @cached_property
    def growing(self) -> Array:
        """All numbers that grow from row to row, sorted."""
        values: set[float] = set()
        for kinds in self.entries.values():
            for rows in kinds.values():
                columns = np.flatnonzero(self._grows(rows)).tolist()
                values |= {row.numbers[k] for row in rows.values() for k in columns}
        return np.array(sorted(values))

    def fewer(self, count: int) -> Scene | None:
        """Return the scene with ``count`` rows, whose last rows are like the last ones of the scene. None if rows at
        the ends have numbers that grow but differ from other rows otherwise."""
        scene, removed = self.scene, self.count - count
        turn = self.first + count - _END
        lists: dict[str, Any] = {}
        groups: dict[str, str] = {}
        for part in _LISTS:
            items, kinds = getattr(scene, part), self.entries[part]
            made = []
            for item in items:
                row = self.row_of(item.name)
                new = item
                if row is None or row >= turn + removed:
                    new = self._at_end(item, removed, turn)
                    if row is not None:
                        rows = kinds[self._kind(item, row)]
                        before, grows = rows.get(row - removed), self._grows(rows)
                        if before is not None and before.is_like(rows[row], grows):
                            new = items[before.place]
                        elif grows.any():
                            return None
                        else:
                            new = _with_start_of(new, None if before is None else items[before.place])
                elif row >= turn:
                    continue
                made.append(new)
                if part == "bodies" and item.name in scene.groups:
                    groups[new.name] = scene.groups[item.name]
            lists[part] = tuple(made)
        nothing: dict[str, Any] = {"requirements": (), "source": {}, "content": b"", "shapes": ()}
        if self.joined and not self.is_hinged and not scene.terms:
            nothing["terms"] = _LINEAR
        return replace(scene, groups=groups, **lists, **nothing)

    def _at_end(self, value: Any, removed: int, turn: int) -> Any:
        """Return nested data with names in rows from ``turn`` on moved ``removed`` rows back."""
        kind = type(value)
        if kind is str:
            row = self.row_of(value)
            return value if row is None or row < turn else self.name_before(value, removed)
        if kind is tuple or kind is list:
            return kind([self._at_end(item, removed, turn) for item in value])
        if is_dataclass(value):
            pairs = [(item.name, getattr(value, item.name)) for item in fields(value) if item.init]
            changed = {name: self._at_end(old, removed, turn) for name, old in pairs}
            return replace(cast("Any", value), **changed)
        return value

    def program(self, derived: Derived) -> tuple[Program, str] | None:
        """Return the Program of the scene, continued from scenes with few rows, and the reason for a missing stepper.

        None if the Programs of the derived scenes do not grow evenly.

        Parameters
        ----------
        derived : returns Program and reason of a scene with few rows, derived in place of a longer one (Sample)

        Raises
        ------
        ModelError
            A function needs more room on the stack than there is.
        """
        attempts = (self._continue_from(few, derived) for few in self._least)
        return next((made for made in attempts if made is not None), None)

    def _continue_from(self, least: int, derived: Derived) -> tuple[Program, str] | None:
        """Return the Program and the reason as ``program`` does, from scenes with at least ``least`` rows."""
        more = _MORE if not self.joined else _MORE_HINGED if self.is_hinged else _MORE_JOINED
        few = least + (self.count - least) % more
        counts = [few + k * more for k in range(3)]
        scenes = [] if 2 * counts[2] > self.count else [self.fewer(count) for count in counts]
        if not scenes or None in scenes:
            return None
        orders: dict[object, Any] | None = {} if self.joined else None
        samples = [Sample(count, self.count - count, orders) for count in counts]
        number, shorter = (self.count - few) // more, cast("list[Scene]", scenes)
        derive, continue_numbers = partial(self._derive, derived), partial(self._continue_numbers, number)
        made = continue_samples(derive, shorter, samples, number, continue_numbers)
        if made is None:
            return None
        q, v = self._start(shorter[0], made[0])
        asked: dict[str, Any] = {"asked_q": q, "asked_v": v} if self.joined and not self.is_hinged else {}
        return replace(made[0], initial_q=q, initial_v=v, **asked), made[1]

    def _derive(self, derived: Derived, scene: Scene, sample: Sample) -> tuple[Program, str]:
        """Return the Program of a shorter scene and the reason for a missing stepper. Raises IrregularSamples if
        assembly changes the initial state, and for Taylor series of trees, which do not grow evenly."""
        program, refusal = derived(scene, sample)
        if not self.joined or self.is_hinged:
            if self.is_hinged and program.series:
                raise IrregularSamples("series")
            return program, refusal
        if (program.initial_q, program.initial_v) != (program.asked_q, program.asked_v):
            raise IrregularSamples("start")
        return replace(program, asked_q=(), asked_v=()), refusal

    @property
    def _least(self) -> tuple[int, ...]:
        """Numbers of rows of the shortest derived scene, in the order in which they are tried."""
        if self.is_hinged:
            freedoms = sum(len(joint.initial_velocity) for joint in self.scene.joints)
            few = max(_FEW_HINGED, _FREEDOMS * self.count // max(1, freedoms))
            return few, few + few // 2
        of_row = max(1, len(self.scene.bodies) // self.count)
        return (_FEW_JOINED,) if self.joined else (max(_FEW_ROWS, -(-_FEW // of_row)),)

    def _start(self, shortest: Scene, program: Program) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return q and v of the initial state of the whole scene, for a Program of the shortest scene."""
        if self.is_hinged:
            return joint_start(Derivation(shortest), self.scene, program.factors)
        if self.joined:
            return AbsoluteStartEquations(self.scene).at({})
        return cast("tuple[tuple[float, ...], tuple[float, ...]]", free_start(self.scene))

    def _continue_numbers(self, number: int, samples: Samples) -> list[float] | None:
        """Return a list of numbers of the whole scene from three lists that grow from row to row; None if they grow
        otherwise. Numbers are chosen among the scene's own, to have the same bits; in joint coordinates they are
        continued sums."""
        if not all(type(item) is float for sample in samples for item in sample):
            return None
        if self.is_hinged:
            return continued_sums(samples, number)
        first, second, third = (np.array(sample) for sample in samples)
        more = len(second) - len(first)
        if len(first) < 2 * more or np.any(second[: len(first)] != first) or np.any(third[: len(second)] != second):
            return None
        step = third[-more:] - third[-2 * more : -more]
        blocks = third[-more:] + step * np.arange(1, number - 1)[:, np.newaxis]
        if not len(self.growing):
            return None
        after = np.clip(np.searchsorted(self.growing, blocks), 1, len(self.growing) - 1)
        low, high = self.growing[after - 1], self.growing[after]
        nearest = np.where(blocks - low < high - blocks, low, high)
        exact = np.where(step == 0.0, blocks, nearest)
        if np.any(np.abs(exact - blocks) > _EVEN * np.max(np.abs(self.growing))):
            return None
        return [*third.tolist(), *exact.ravel().tolist()]


@cache
def _names(kind: Hashable) -> tuple[str, ...]:
    """Return the fields of a class of data that equations follow from, none of any other class."""
    return (
        tuple(item.name for item in fields(cast("Any", kind)) if item.name not in _START) if is_dataclass(kind) else ()
    )


def _reach(data: object) -> int:
    """Return the largest distance in rows of the names within data."""
    if not isinstance(data, tuple):
        return 0
    if len(data) == 4 and isinstance(data[0], tuple) and isinstance(data[2], int) and isinstance(data[1], tuple):
        return abs(data[2])
    return max(map(_reach, data), default=0)


def _is_even(column: Array) -> bool:
    """Return whether numbers grow evenly but for rounding."""
    line = column[0] + (column[-1] - column[0]) * np.arange(len(column)) / (len(column) - 1)
    return bool(np.max(np.abs(column - line)) <= _EVEN * np.max(np.abs(column)))


def _with_start_of(item: Any, source: Any) -> Any:
    """Return a body or joint with the initial position and velocity of another."""
    if source is None:
        return item
    return replace(item, **{item_.name: getattr(source, item_.name) for item_ in fields(item) if item_.name in _START})
