"""Programs of scenes with many equal elements of beams, continued from scenes with few of them.

Three scenes are derived that differ from the given one in the number of its equal elements alone, and
``codegen.continuation`` checks that their Programs grow evenly. So the work of a derivation is the same for a beam of
200 elements and of 10 000.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, groupby, pairwise
from typing import Any, cast

from eomgen.base.data import dataclass, fields, is_dataclass, replace
from eomgen.base.drawing_process import from_copy
from eomgen.codegen.continuation import IrregularSamples, Known, Samples, continued_program
from eomgen.codegen.convert import check_workspace
from eomgen.codegen.program import Program
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.initial_coordinates import joint_start
from eomgen.mechanics.scene_tape import Derivation
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.system.system import WHOLE, Sample

#: Least number of elements of the smallest derived scene, and increment to the next scene. A scene with one clamped
#: beam of equal elements needs fewer than others, which have loops outside of the run, too; the last 20 elements may
#: be eliminated in an order of their own.
_FEW, _FEW_OF_OTHERS, _MORE = 28, 80, 4
#: Numbers of equal elements, of the same scenes, above which three scenes with few elements are derived faster.
_MANY, _MANY_OF_OTHERS = 160, 400
#: Sections of a scene that hold no numbers of elements and no places along a beam.
_PLAIN = frozenset({"beams", "forces", "springs", "torsion_springs", "bushings", "efforts"})
_BY_ELEMENT = frozenset({"section_load", "place", "local"})

Derived = Callable[[Scene, Sample], tuple[Program, str]]


@dataclass(frozen=True)
class EqualRange:
    """Equal elements of a beam, ``first .. first + count - 1``, between which only nodes of the beam are."""

    beam: Cosserat
    first: int
    count: int

    def shorten(self, removed: int) -> tuple[Cosserat, dict[str, str | None]]:
        """Return the beam without ``removed`` elements in the middle of the run, and the new name of each later node.
        Removed nodes are mapped to None."""
        parts, middle = self.beam.parts, self.first + 2
        shorter = replace(self.beam, parts=parts[:middle] + parts[middle + removed :])
        nodes = self.beam.nodes
        names: dict[str, str | None] = dict.fromkeys(nodes[middle : middle + removed])
        return shorter, names | dict(zip(nodes[middle + removed :], shorter.nodes[middle:], strict=True))


@dataclass(frozen=True)
class EqualElements:
    """The longest runs of equal elements in a scene, at most one run per beam, all with ``count`` elements."""

    scene: Scene
    runs: tuple[EqualRange, ...]

    @property
    def count(self) -> int:
        return self.runs[0].count

    @property
    def alone(self) -> bool:
        """Whether the scene has one beam, clamped, of equal elements, without constrained strains, and all other joints
        are fixed."""
        beams = _beams(self.scene)
        if len(beams) > 1 or beams[0].absent_strains or self.count < beams[0].elements:
            return False
        nodes = set(beams[0].nodes[1:])
        return all(joint.type == "fixed" or joint.child in nodes for joint in self.scene.joints)

    def fewer(self, count: int) -> Scene:
        """Return the scene with runs of ``count`` elements; nodes, joints and names beyond are removed or renamed."""
        beams: dict[str, Cosserat] = {}
        names: dict[str, str | None] = {}
        for run in self.runs:
            beams[run.beam.name], renamed = run.shorten(self.count - count)
            names |= renamed
        scene = self.scene
        kept = replace(
            scene,
            bodies=tuple(body for body in scene.bodies if names.get(body.name, "") is not None),
            joints=tuple(joint for joint in scene.joints if names.get(joint.child, "") is not None),
            elements=tuple(
                replace(item, beam=beams[item.beam.name])
                if isinstance(item, CosseratBeam) and item.beam.name in beams
                else item
                for item in scene.elements
            ),
        )
        return cast("Scene", _rename(kept, {old: new for old, new in names.items() if new is not None}))

    def program(self, derived: Derived) -> tuple[Program, str] | None:
        """Return the Program of the scene, continued from scenes with few elements, and the reason for a missing
        stepper.

        None if the Programs of the derived scenes do not grow evenly.

        Parameters
        ----------
        derived : returns Program and reason of a scene with few elements, derived in place of a longer one (Sample)

        Raises
        ------
        ModelError
            A function needs more room on the stack than there is.
        """
        made = self._continue(derived, _FEW) if self.alone else None
        return made or (self._continue(derived, _FEW_OF_OTHERS) if self.count >= _MANY_OF_OTHERS else None)

    def _continue(self, derived: Derived, least: int) -> tuple[Program, str] | None:
        """Return the Program and the reason as ``program`` does, from scenes with at least ``least`` elements."""
        few = least + self.count % _MORE
        counts = [few + k * _MORE for k in range(3)]
        scenes = list(map(self.fewer, counts))
        long = least == _FEW_OF_OTHERS  # 80 elements have all loops of longer scenes
        samples = [WHOLE if long else Sample(n, self.count - n) for n in counts]
        middles = [_middles(scene) for scene in (*scenes, self.scene)]

        def middles_of_scene(samples: Samples) -> tuple[float, ...] | None:
            places = [tuple(item for item in sample if isinstance(item, float)) for sample in samples]
            return middles[3] if places == middles[:3] else None

        made = continue_samples(derived, scenes, samples, (self.count - few) // _MORE, middles_of_scene)
        if made is None:
            return None
        q, v = joint_start(Derivation(scenes[0]), self.scene, made[0].factors)
        return replace(made[0], initial_q=q, initial_v=v), made[1]


def continue_samples(
    derived: Derived, scenes: Sequence[Scene], samples: Sequence[Sample], number: int, known: Known
) -> tuple[Program, str] | None:
    """Return the Program of a scene, continued by ``number`` steps from three scenes, and the reason for a missing
    stepper.

    None if the three Programs do not grow evenly. The last of the three is derived by a copy of the process, if one may
    be made.

    Parameters
    ----------
    derived : returns Program and reason of a scene and its sample
    scenes, samples : three scenes with evenly more equal parts, and for each the longer scene that is meant
    known : as of ``continued_program``

    Raises
    ------
    ModelError
        A function needs more room on the stack than there is.
    """
    try:
        first = derived(scenes[0], samples[0])  # with imports, and laws that the other scenes share
        with from_copy(partial(derived, scenes[2], samples[2])) as third:
            second = derived(scenes[1], samples[1])
            made = [first, second, third() or derived(scenes[2], samples[2])]
        if len({refusal for _, refusal in made}) > 1:
            return None
        program = continued_program([program for program, _ in made], number, known)
    except IrregularSamples:
        return None
    for function in program.functions:
        check_workspace(function.name, function.workspace)
    return program, first[1]


def equal_elements(scene: Scene) -> EqualElements | None:
    """Return the longest runs of equal elements of a scene; None if the runs are short, or if the scene names elements
    by number or place, constrains bodies, or carries one beam by another."""
    beams = _beams(scene)
    if max((beam.elements for beam in beams), default=0) < _MANY or not _is_plain(scene):
        return None
    nodes = {node for beam in beams for node in beam.nodes[1:]}
    mentioned = _texts_outside_beams(scene, nodes)
    carriers = {joint.child: joint.parent for joint in scene.joints}
    if mentioned is None or not nodes.isdisjoint(carriers.get(beam.name, "") for beam in beams):
        return None
    runs = [run for beam in beams for run in _runs(beam, mentioned)]
    longest = max((run.count for run in runs), default=0)
    chosen = {run.beam.name: run for run in runs if run.count == longest}
    alike = EqualElements(scene, tuple(chosen.values()))
    return alike if longest >= (_MANY if alike.alone else _MANY_OF_OTHERS) else None


def _is_plain(scene: Scene) -> bool:
    """Return whether a scene has no constraints, and no parts with numbers of elements or places along a beam."""
    if scene.constraints or scene.coordinates != "joint" or any(scene.parts.values()):
        return False
    return all(item.section in _PLAIN for item in scene.elements)


def _texts_outside_beams(scene: Scene, nodes: Collection[str]) -> set[str] | None:
    """Return all texts of a scene outside of beams and ``nodes``; None for formulas by element or place."""
    apart = replace(
        scene,
        bodies=tuple(body for body in scene.bodies if body.name not in nodes),
        joints=tuple(joint for joint in scene.joints if joint.child not in nodes),
        elements=tuple(item for item in scene.elements if not isinstance(item, CosseratBeam)),
        source={},
        requirements=(),
    )
    texts: set[str] = set()
    for item in _leaves(apart):
        if isinstance(item, Symbol):
            if item.kind in _BY_ELEMENT:
                return None
        elif isinstance(item, str):
            texts.add(item)
    return texts


def _runs(beam: Cosserat, mentioned: set[str]) -> Iterator[EqualRange]:
    """Yield the runs of equal elements of a beam in order; nodes with names in ``mentioned`` are between two runs."""
    ends = {number for number, node in enumerate(beam.nodes) if node in mentioned}
    pieces = [0]
    for number in range(1, beam.elements):
        before, after = beam.parts[number - 1 : number + 1]
        same = before is after or (before.length, before.twist) == (after.length, after.twist)
        same = same and (before.section is after.section or before.section == after.section)
        pieces.append(pieces[-1] + (number in ends or not same))
    first = 0
    for _, alike in groupby(pieces):
        count = len(list(alike))
        yield EqualRange(beam, first, count)
        first += count


def _beams(scene: Scene) -> list[Cosserat]:
    return [item.beam for item in scene.elements if isinstance(item, CosseratBeam)]


def _middles(scene: Scene) -> tuple[float, ...]:
    """Return the places of the elements' middles at rest, in the order of the term ``section_loads``."""
    return tuple(0.5 * (start + end) for beam in _beams(scene) for start, end in pairwise(beam.places))


def _leaves(value: Any) -> Iterator[Any]:
    """Yield all symbols and texts within nested data of a scene, keys of mappings included."""
    if isinstance(value, Symbol | str):
        yield value
    if isinstance(value, Mapping):
        yield from chain.from_iterable(_leaves(item) for pair in value.items() for item in pair)
    elif isinstance(value, list | tuple | set | frozenset):
        yield from chain.from_iterable(map(_leaves, value))
    elif is_dataclass(value):
        yield from chain.from_iterable(_leaves(getattr(value, item.name)) for item in fields(value))


def _rename(value: Any, names: Mapping[str, str]) -> Any:
    """Return nested data of a scene with names of nodes replaced by ``names``; beams stay unchanged."""
    kind = type(value)
    if kind is str:
        return names.get(value, value)
    if kind in (list, tuple):
        items = [_rename(item, names) for item in value]
        return value if all(map(operator.is_, items, value)) else kind(items)
    if isinstance(value, Mapping):
        return {names.get(key, key): _rename(item, names) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, Cosserat):
        pairs = [(item.name, getattr(value, item.name)) for item in fields(value) if item.init]
        changed = {name: new for name, old in pairs if (new := _rename(old, names)) is not old}
        return replace(cast("Any", value), **changed) if changed else value
    return value
