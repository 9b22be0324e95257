"""Programs of scenes with many equal parts in a row, continued from scenes with shorter rows.

Three scenes are derived that differ from the given one in the numbers of equal parts alone, and
``codegen.continuation`` checks that their Programs grow evenly. So the work of a derivation is the same for a beam of
200 elements and of 10 000. Runs before and after a different part become shorter together, by the same number of
groups of parts; the rest of a longer run is continued from scenes that are continued themselves.
"""

from __future__ import annotations

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import NoneType
from typing import Any, NamedTuple, cast

from eomgen.base.data import dataclass, fields, is_dataclass, replace
from eomgen.base.drawing_process import compute_in_copy
from eomgen.codegen.continuation import IrregularSamples, Known, continued_program
from eomgen.codegen.convert import check_workspace
from eomgen.codegen.program import Program
from eomgen.scene.scene import Scene
from eomgen.system.system import Sample

Derived = Callable[[Scene, Sample], tuple[Program, str]]
#: Values of fields of a Program.
Start = dict[str, Any]


class Shortening(NamedTuple):
    """Steps from the shortest of three scenes to the whole one.

    Attributes
    ----------
    least : groups of parts in the shortest run that grows, in the shortest scene
    more : groups of parts in a step, of each run that grows
    number : steps
    grows : whether a run grows, for each run
    """

    least: int
    more: int
    number: int
    grows: tuple[bool, ...] = (True,)


#: Shortening of a scene, then of the shorter scenes, until these are derived.
Plan = Sequence[Shortening]
#: Parts of the longest group that is looked for.
LONGEST = 4
#: Least number of equal groups in a run of the smallest derived scene in joint coordinates, and increment to the next.
FEW, MORE = 28, 4
#: Work of three derivations and their comparison, as a multiple of the work of the second one.
_WORK = 4.75


class EqualGroups(NamedTuple):
    """A run of equal groups of ``period`` parts from part ``first`` on."""

    first: int
    period: int
    groups: int

    def middle(self, groups: int) -> range:
        """Return the parts of so many groups after the second group."""
        start = self.first + 2 * self.period
        return range(start, start + groups * self.period)


def find_runs(first: int, end: int, groups: Callable[[int, int], int]) -> Iterator[EqualGroups]:
    """Yield runs of the parts from ``first`` to before ``end``, in order. At each part the group by which most parts
    repeat is taken, the shortest of several.

    Parameters
    ----------
    groups : returns the number of equal groups from a part on, at least 1, for a number of parts of a group
    """
    while first < end:
        counts = {period: groups(first, period) for period in range(1, LONGEST + 1)}
        period = max(counts, key=lambda period: (counts[period] * period * (counts[period] > 1), -period))
        yield EqualGroups(first, period, counts[period])
        first += period * counts[period]


@dataclass(frozen=True)
class EqualParts(ABC):
    """A scene with runs of equal parts."""

    scene: Scene

    @property
    @abstractmethod
    def sizes(self) -> Sequence[tuple[int, int]]:
        """Number of groups and parts of a group, for each run."""

    @property
    @abstractmethod
    def plans(self) -> Sequence[Plan]:
        """Steps to the shortest scene, in the order in which they are tried; none for a scene that is derived with less
        work."""

    @abstractmethod
    def fewer(self, removed: Sequence[int]) -> Scene | None:
        """Return the scene without so many groups of each run, None if the rest would be another scene."""

    @abstractmethod
    def start(self, shortest: Scene, program: Program) -> Start:
        """Return the initial state of the whole scene for its Program, whose shortest derived scene is given."""

    @abstractmethod
    def rule(self, scenes: Sequence[Scene], number: int) -> Known:
        """Return the rule by which lists of numbers are continued by ``number`` steps from three scenes."""

    @abstractmethod
    def sample(self, parts: int, missing: int, orders: dict[object, Any]) -> Sample:
        """Return the sample of a scene with so many groups in the shortest run that grows; ``orders`` of pivots may be
        shared by the samples."""

    def find(self, scene: Scene) -> EqualParts | None:
        """Return the runs of a shorter scene."""
        return None

    def program(self, derived: Derived) -> tuple[Program, str] | None:
        """Return the Program of the scene, continued from shorter scenes, and the reason for a missing stepper.

        None if the Programs of the derived scenes do not grow evenly.

        Parameters
        ----------
        derived : returns Program and reason of a short scene, derived in place of a longer one (Sample)

        Raises
        ------
        ModelError
            A function needs more room on the stack than there is.
        """
        attempts = (self._continue(derived, plan) for plan in self.plans)
        return next((made for made in attempts if made is not None), None)

    def _continue(self, derived: Derived, plan: Plan) -> tuple[Program, str] | None:
        """Return the Program and the reason as ``program`` does, by the steps of a plan. The last of the three scenes
        is derived by a copy of the process, if one may be made."""
        (least, more, number, grows), *further = plan
        if len(grows) != len(self.sizes):  # shorter runs have become one
            return None
        scenes = [self.fewer([more * (number - k) * long for long in grows]) for k in range(3)]
        shorter = [scene for scene in scenes if scene is not None]
        if len(shorter) < len(scenes):
            return None
        orders: dict[object, Any] = {}
        samples = [self.sample(least + more * k, more * (number - k), orders) for k in range(3)]
        derive = partial(self._continue_or_derive, derived, further)
        try:
            first = derive(shorter[0], samples[0])  # with imports, and laws that the other scenes share
            with compute_in_copy(partial(derive, shorter[2], samples[2])) as third:
                second = derive(shorter[1], samples[1])
                made = [first, second, third() or derive(shorter[2], samples[2])]
            if len({refusal for _, refusal in made}) > 1:
                return None
            program = continued_program([item for item, _ in made], number, self.rule(shorter, number))
        except IrregularSamples:
            return None
        for function in program.functions:
            check_workspace(function.name, function.workspace)
        return replace(program, **self.start(shorter[0], program)), first[1]

    def _continue_or_derive(self, derived: Derived, plan: Plan, scene: Scene, sample: Sample) -> tuple[Program, str]:
        if not plan:
            return derived(scene, sample)
        parts = self.find(scene)
        made = None if parts is None else parts._continue(derived, plan)
        if made is None:
            raise IrregularSamples("a run that stays long")
        return made


def least_work(
    runs: Sequence[tuple[int, int]], parts: float, least: int, more: int, most: float = math.inf
) -> tuple[float, Plan]:
    """Return the least work for a scene with these runs and the plan; the unit is the derivation of one part.

    Parameters
    ----------
    runs : number of groups and parts of a group, for each run
    parts : of the scene
    least, more : number of groups in a run of the smallest scene, and in a step
    most : work that is too much for a plan
    """
    best: tuple[float, Plan] = parts, ()
    long = {count for count, _ in runs if count >= least + 3 * more}
    fewest = sum(min(count, least) * period for count, period in runs)
    for shortest in long if _WORK * fewest < min(parts, most) else ():
        number = (shortest - least) // more
        grows = tuple(count >= shortest for count, _ in runs)
        removed = [more * (number - 1) * long for long in grows]  # of the middle one of three scenes
        fewer = [(count - groups, period) for (count, period), groups in zip(runs, removed, strict=True)]
        left = parts - sum(groups * period for groups, (_, period) in zip(removed, runs, strict=True))
        work, further = least_work(fewer, left, least, more, best[0] / _WORK)
        step = Shortening(shortest - more * number, more, number, grows)
        best = min(best, (_WORK * work, (step, *further)))
    return best


def rename(value: Any, name: Callable[[str], str], kept: type = NoneType) -> Any:
    """Return nested data of a scene with ``name`` of each text; objects of the class ``kept`` stay unchanged."""
    kind = type(value)
    if kind is str:
        return name(value)
    if kind in (list, tuple):
        items = [rename(item, name, kept) for item in value]
        return value if all(map(operator.is_, items, value)) else kind(items)
    if isinstance(value, Mapping):
        return {name(key): rename(item, name, kept) for key, item in value.items()}
    if is_dataclass(value) and kind is not kept:
        pairs = [(item.name, getattr(value, item.name)) for item in fields(value) if item.init]
        changed = {key: new for key, old in pairs if (new := rename(old, name, kept)) is not old}
        return replace(cast("Any", value), **changed) if changed else value
    return value
