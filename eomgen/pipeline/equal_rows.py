"""Programs of nets and chains: scenes with many equal rows of bodies in absolute coordinates, free or on joints, or in
joint coordinates, continued from scenes with few rows.

Rows are numbered by integers in the names of bodies, points and force elements, as ``[repeat]`` makes them. Three
scenes with fewer rows are derived. That the rows of a run are equal is checked here: apart from the state at the start,
numbers of a row are the same in all rows, or grow evenly.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from functools import cache, cached_property, partial
from itertools import chain, compress
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, fields, is_dataclass, replace
from eomgen.base.rounding import COMPUTED
from eomgen.codegen.continuation import IrregularSamples, Known, Samples, continued_sums
from eomgen.codegen.program import Program
from eomgen.formula.nodes import ZERO, Number
from eomgen.mechanics.initial_coordinates import AbsoluteStartEquations, free_start, joint_start
from eomgen.mechanics.scene_tape import Derivation
from eomgen.pipeline.equal_parts import (
    FEW,
    LONGEST,
    MORE,
    Derived,
    EqualGroups,
    EqualParts,
    Plan,
    Start,
    find_runs,
    least_work,
    rename,
)
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.system import Sample
from eomgen.system.terms import TERMS

#: The parts of a name between its numbers, and the numbers.
Parts = tuple[tuple[str, ...], tuple[int, ...]]
Entries = dict[str, dict[object, dict[int, tuple[float, ...]]]]
#: Least bodies of the smallest derived scene of free bodies.
_FEW = 100
#: Distance of rows from which on a row that names the other one is distant.
_END = 3
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
    rows are few, or if the scene has other parts than bodies, joints, points, force elements and parameters; scenes
    with joints other than free ones must be plain chains."""
    rows = _find_rows(scene)
    return rows if rows is not None and rows.entries["bodies"] and rows.plans else None


def _find_rows(scene: Scene) -> EqualRows | None:
    """Return the rows of a scene as ``equal_rows`` does, short runs too."""
    hinged = scene.coordinates == "joint"
    joined = any(joint.type != "free" for joint in scene.joints)
    if (joined or hinged) and not _is_plain_chain(scene, hinged):
        return None
    if any(scene.parts.values()) or any(getattr(scene, item.name) for item in fields(scene) if item.name not in _PLAIN):
        return None
    names = [item.name for part in _LISTS for item in getattr(scene, part)]
    numbered = _find_numbers(names) if names and len(set(names)) >= len(scene.bodies) else None
    rows = None if numbered is None else EqualRows(scene, *numbered, joined, hinged)
    if rows is None or any(rows.row_of(parameter.name) is not None for parameter in scene.parameters):
        return None
    return rows


def _is_plain_chain(scene: Scene, hinged: bool) -> bool:
    """Return whether a scene has no force elements, no drives or mimic relations, and no wanted term that is a whole
    matrix. In absolute coordinates (not ``hinged``) joints must not have springs, stops or friction either: forces are
    recorded one by one, so their loops grow unevenly."""

    def is_simple(joint: Joint) -> bool:
        connects_only = not (joint.stops or joint.friction) and joint.stiffness == joint.damping == ZERO
        return not (joint.drive or joint.mimic) and (hinged or connects_only)

    whole = any(TERMS[name].quadratic for name in scene.terms if name in TERMS)
    return not whole and not scene.elements and all(map(is_simple, scene.joints))


def _find_numbers(names: Sequence[str]) -> tuple[Mapping[tuple[str, ...], int], int, int] | None:
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
class EqualRows(EqualParts):
    """A scene with equal rows of bodies, numbered in names, whose Program is continued from scenes with fewer rows.

    Attributes
    ----------
    places : which integer in a name is the number of the row, by the other parts of the name
    first, last : rows
    joined : whether bodies have other joints than free ones
    hinged : whether the scene is in joint coordinates
    """

    places: Mapping[tuple[str, ...], int]
    first: int
    last: int
    joined: bool
    hinged: bool

    @property
    def count(self) -> int:
        return self.last - self.first + 1

    @cached_property
    def runs(self) -> tuple[EqualGroups, ...]:
        """The runs of equal groups of rows: entries are equal, and numbers grow evenly from group to group. No row of a
        run is named by a distant row, or by an entry outside of rows."""
        kinds = [rows for entries in self.entries.values() for rows in entries.values()]
        periods = range(1, LONGEST + 1)
        even = {period: np.all([self._is_even(rows, period) for rows in kinds], axis=0) for period in periods}

        def groups(start: int, period: int) -> int:
            alike = int(np.argmin(even[period][start - self.first :]))
            return alike // period + 2 if alike >= period else 1

        return tuple(find_runs(self.first, self.last + 1, groups))

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

    @property
    def entries(self) -> Entries:
        """Bodies, joints, points and force elements in rows: by list, by kind (type, name without row, data without
        numbers, Lie group) and by row; place in the list, then numbers."""
        return self._read[0]

    @property
    def named_from_afar(self) -> list[int]:
        """Rows that are named by distant rows or by entries outside of rows, and these distant rows."""
        return sorted(self._read[1])

    @cached_property
    def _read(self) -> tuple[Entries, set[int]]:
        entries: Entries = {}
        far: set[int] = set()
        for part in _LISTS:
            kinds = entries.setdefault(part, {})
            for index, item in enumerate(getattr(self.scene, part)):
                row, numbers, named = self.row_of(item.name), [float(index)], set[int]()
                kind = self._kind(item, row or 0, numbers, named)
                distant = {number for number in named if row is None or abs(number - row) >= _END}
                far |= distant
                if row is not None:
                    far |= {row} if distant else set()
                    kinds.setdefault(kind, {})[row] = tuple(numbers)
        return entries, far

    def _kind(self, item: Any, row: int, numbers: list[float], named: set[int]) -> object:
        data = self._data(item, row, numbers, named)
        return type(item), self.name_before(item.name, row), data, self.scene.groups.get(item.name)

    def _data(self, value: Any, row: int, numbers: list[float], named: set[int]) -> object:
        """Return nested data that are equal for equal parts of two rows; add all numbers to ``numbers``, and the rows
        of all names to ``named``. Numbers are replaced by the type, and rows in names are relative to ``row``."""
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
            if index is None:
                return value
            named.add(integers[index])
            return shape, integers[:index], integers[index] - row, integers[index + 1 :]
        if kind is tuple or kind is list:
            return tuple([self._data(item, row, numbers, named) for item in value])
        names = _names(cast("Hashable", kind))
        return (kind, *[self._data(getattr(value, name), row, numbers, named) for name in names]) if names else value

    def _is_even(self, rows: Mapping[int, tuple[float, ...]], period: int) -> NDArray[np.bool_]:
        """Return for each row whether this row, and the rows one and two groups later, have no entry of a kind, or
        entries with numbers and places that grow evenly but for rounding. False for rows that are named from afar."""
        table = np.zeros((self.count, 1 + len(next(iter(rows.values())))))
        for number, numbers in rows.items():
            table[number - self.first] = 1.0, *numbers
        first, second, third = table[: -2 * period], table[period:-period], table[2 * period :]
        slack = COMPUTED * np.max(np.abs(table), axis=0)
        slack[:2] = 0.0
        even = np.all((np.abs(first - 2.0 * second + third) <= slack), axis=1) & (first[:, 0] == second[:, 0])
        free = ~np.isin(np.arange(self.first, self.last + 1), self.named_from_afar)
        return np.append(even & free[: -2 * period] & free[period:-period] & free[2 * period :], [False] * 2 * period)

    @cached_property
    def grows(self) -> Mapping[object, NDArray[np.bool_] | None]:
        """Whether each number of the entries of a kind differs within a run: then the number grows evenly over all rows
        of the scene. None if a number does otherwise, as one that grows in one of two runs."""
        return {kind: self._growth(rows) for entries in self.entries.values() for kind, rows in entries.items()}

    def _growth(self, rows: Mapping[int, tuple[float, ...]]) -> NDArray[np.bool_] | None:
        order = np.array(sorted(rows))
        table = np.array([rows[row][1:] for row in order]).reshape(len(order), -1)
        grown = np.zeros(table.shape[1], dtype=bool)
        for run in self.runs:
            for first in range(run.first, run.first + run.period):
                part = table[np.isin(order, range(first, first + run.groups * run.period, run.period))]
                grown |= np.any(part != part[:1], axis=0)
        x, progress = table[:, grown], (order - order[0]) / max(1, order[-1] - order[0])
        line = x[0] + (x[-1] - x[0]) * progress[:, np.newaxis]
        return grown if np.all(np.abs(x - line) <= COMPUTED * np.max(np.abs(x), axis=0)) else None

    @cached_property
    def growing(self) -> Array:
        """All numbers that grow from row to row, sorted."""
        every = [(rows, self.grows[kind]) for entries in self.entries.values() for kind, rows in entries.items()]
        values = (compress(row[1:], cast("Any", grows)) for rows, grows in every for row in rows.values())
        return np.array(sorted({*chain.from_iterable(values)}))

    def fewer(self, removed: Sequence[int]) -> Scene | None:
        """Return the scene without so many groups of each run. None if rows after a removed one have numbers that
        grow but differ from other rows otherwise."""
        scene = self.scene
        gaps = [run.middle(groups) for run, groups in zip(self.runs, removed, strict=True) if groups]
        left_out = {*chain.from_iterable(gaps)}

        def rows_before(row: int) -> int:
            return sum(len(gap) for gap in gaps if row >= gap.start)

        def name_in(row: int | None, name: str) -> str:
            number = self.row_of(name)
            if number is None:
                return name
            return self.name_before(name, rows_before(number if row is None or abs(number - row) >= _END else row))

        lists: dict[str, Any] = {}
        groups: dict[str, str] = {}
        for part in _LISTS:
            items, kinds, made = getattr(scene, part), self.entries[part], []
            by_name = {item.name: item for item in items}
            for item in items:
                row = self.row_of(item.name)
                if row in left_out:
                    continue
                new = rename(item, partial(name_in, row))
                if row is not None and (missing := rows_before(row)):
                    before = by_name.get(self.name_before(item.name, missing))
                    kind = self._kind(item, row, [], set())
                    rows, grows = kinds[kind], cast("NDArray[np.bool_]", self.grows[kind])
                    numbers = zip(rows[row][1:], rows.get(row - missing, ())[1:], grows, strict=False)
                    if row - missing in rows and all(free or a == b for a, b, free in numbers):
                        new = before  # with numbers that grow to its row
                    elif grows.any():
                        return None
                    else:
                        new = _with_start_of(new, before)
                made.append(new)
                if part == "bodies" and item.name in scene.groups:
                    groups[new.name] = scene.groups[item.name]
            lists[part] = tuple(made)
        nothing: dict[str, Any] = {"requirements": (), "source": {}, "content": b"", "shapes": ()}
        if self.joined and not self.hinged and not scene.terms:
            nothing["terms"] = _LINEAR
        return replace(scene, groups=groups, **lists, **nothing)

    @property
    def sizes(self) -> Sequence[tuple[int, int]]:
        """Number of groups and rows of a group, for each run."""
        return [(run.groups, run.period) for run in self.runs]

    @property
    def plans(self) -> Sequence[Plan]:
        """Steps to the shortest scene, in the order in which they are tried; none if three scenes are not shorter."""
        unknown_start = not (self.joined or self.hinged) and free_start(self.scene) is None
        if unknown_start or any(grows is None for grows in self.grows.values()):
            return []
        more = 2 if not self.joined else MORE if self.hinged else 1
        every = (least_work(self.sizes, self.count, least, more)[1] for least in self._least)
        return [plan for plan in every if plan]

    def find(self, scene: Scene) -> EqualParts | None:
        """Return the rows of a shorter scene."""
        return _find_rows(scene)

    def program(self, derived: Derived) -> tuple[Program, str] | None:
        """Return the Program and the reason for a missing stepper."""
        return super().program(partial(self._derive, derived))

    def _derive(self, derived: Derived, scene: Scene, sample: Sample) -> tuple[Program, str]:
        """Return the Program of a shorter scene and the reason for a missing stepper. Raises IrregularSamples if
        assembly changes the initial state, and for Taylor series of trees, which do not grow evenly."""
        program, refusal = derived(scene, sample)
        if self.hinged and program.series:
            raise IrregularSamples("series")
        absolute = self.joined and not self.hinged
        if absolute and (program.initial_q, program.initial_v) != (program.asked_q, program.asked_v):
            raise IrregularSamples("start")
        return program, refusal

    @property
    def _least(self) -> tuple[int, ...]:
        """Numbers of rows of the shortest derived scene, in the order in which they are tried."""
        if self.hinged:
            # chains of fewer than 60 velocities have functions without loops, and loops of some lengths begin elsewhere
            freedoms = sum(len(joint.initial_velocity) for joint in self.scene.joints)
            few = max(FEW, 60 * self.count // max(1, freedoms))
            return few, few + few // 2
        if self.joined:
            return (18,)  # the first rows have pivots of their own
        return (max(10, -(-_FEW // max(1, len(self.scene.bodies) // self.count))),)

    def sample(self, parts: int, missing: int, orders: dict[object, Any]) -> Sample:
        """Return the sample of a scene."""
        return Sample(parts, missing, orders if self.joined else None)

    def start(self, shortest: Scene, program: Program) -> Start:
        """Return the initial state of the whole scene, which is also the requested one."""
        if self.hinged:
            q, v = joint_start(Derivation(shortest), self.scene, program.factors)
        else:
            q, v = AbsoluteStartEquations(self.scene).at({}) if self.joined else cast("Any", free_start(self.scene))
        asked = {"asked_q": q, "asked_v": v} if self.joined and not self.hinged else {}
        return {"initial_q": q, "initial_v": v, **asked}

    def rule(self, _: Sequence[Scene], number: int) -> Known:
        """Return the rule for numbers that grow from row to row."""
        return partial(self._continue_numbers, number)

    def _continue_numbers(self, number: int, samples: Samples) -> list[float] | None:
        """Return a list of numbers of the whole scene from three lists that grow from row to row; None if they grow
        otherwise. Numbers are chosen among the scene's own, to have the same bits; in joint coordinates they are
        continued sums."""
        if not all(type(item) is float for sample in samples for item in sample):
            return None
        if self.hinged:
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
        if np.any(np.abs(exact - blocks) > COMPUTED * np.max(np.abs(blocks), axis=0)):
            return None
        return [*third.tolist(), *exact.ravel().tolist()]


@cache
def _names(kind: Hashable) -> tuple[str, ...]:
    """Return the fields of a class of data that equations follow from, none of any other class."""
    return (
        tuple(item.name for item in fields(cast("Any", kind)) if item.name not in _START) if is_dataclass(kind) else ()
    )


def _with_start_of(item: Any, source: Any) -> Any:
    """Return a body or joint with the initial position and velocity of another."""
    if source is None:
        return item
    return replace(item, **{item_.name: getattr(source, item_.name) for item_ in fields(item) if item_.name in _START})
