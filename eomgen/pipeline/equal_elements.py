"""Equal elements of geometrically exact beams, and the scene with fewer elements."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import partial
from itertools import chain, pairwise, takewhile
from typing import Any

from eomgen.base.data import dataclass, replace
from eomgen.codegen.continuation import Known, Samples
from eomgen.codegen.program import Program
from eomgen.mechanics.initial_coordinates import joint_start
from eomgen.mechanics.scene_tape import Derivation
from eomgen.pipeline.equal_parts import FEW, MORE, EqualGroups, EqualParts, Plan, Start, find_runs, least_work, rename
from eomgen.scene.bodies.cosserat import BeamElement, Cosserat
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.system.system import WHOLE, Sample

#: Least number of equal groups of beams that are not clamped, which have loops outside of the runs, too; the last 20
#: elements may be eliminated in an order of their own.
_FEW_OF_OTHERS = 80
#: Sections of a scene that hold no numbers of elements and no places along a beam; kinds of symbols that do.
_PLAIN = frozenset({"beams", "forces", "springs", "torsion_springs", "bushings", "efforts"})
_BY_ELEMENT = frozenset({"section_load", "place", "local"})


@dataclass(frozen=True)
class EqualElements(EqualParts):
    """The runs of equal groups of elements in a scene, each with its beam; only nodes of the beam are between them."""

    runs: tuple[tuple[Cosserat, EqualGroups], ...]

    @property
    def sizes(self) -> Sequence[tuple[int, int]]:
        """Number of groups and elements of a group, for each run."""
        return [(run.groups, run.period) for _, run in self.runs]

    @property
    def is_clamped(self) -> bool:
        """Whether no strains are constrained, and all joints beyond nodes of beams are fixed."""
        beams = _beams(self.scene)
        nodes = {node for beam in beams for node in beam.nodes[1:]}
        unconstrained = not any(beam.absent_strains for beam in beams)
        return unconstrained and all(joint.type == "fixed" or joint.child in nodes for joint in self.scene.joints)

    @property
    def plans(self) -> tuple[Plan, ...]:
        """Steps to the shortest scene, in the order in which they are tried."""
        elements = sum(beam.elements for beam in _beams(self.scene))
        every = (FEW, _FEW_OF_OTHERS) if self.is_clamped else (_FEW_OF_OTHERS,)
        return tuple(plan for least in every if (plan := least_work(self.sizes, elements, least, MORE)[1]))

    def fewer(self, removed: Sequence[int]) -> Scene:
        """Return the scene without so many groups of each run; nodes, joints and names beyond are removed or
        renamed."""
        beams: dict[str, Cosserat] = {}
        names: dict[str, str | None] = {}
        for beam in _beams(self.scene):
            shortened = zip(self.runs, removed, strict=True)
            middles = [run.middle(groups) for (of_run, run), groups in shortened if of_run is beam]
            left_out = {*chain.from_iterable(middles)}
            kept = [number for number in range(beam.elements + 1) if number not in left_out]
            beams[beam.name] = shorter = replace(beam, parts=tuple(beam.parts[number] for number in kept[:-1]))
            names |= dict.fromkeys(beam.nodes[number] for number in left_out)
            names |= zip([beam.nodes[number] for number in kept], shorter.nodes, strict=True)
        scene = self.scene
        kept_parts = replace(
            scene,
            bodies=tuple(body for body in scene.bodies if names.get(body.name, "") is not None),
            joints=tuple(joint for joint in scene.joints if names.get(joint.child, "") is not None),
            elements=tuple(
                replace(item, beam=beams[item.beam.name]) if isinstance(item, CosseratBeam) else item
                for item in scene.elements
            ),
        )
        short: Scene = rename(kept_parts, lambda name: names.get(name) or name, Cosserat)
        return short

    def start(self, shortest: Scene, program: Program) -> Start:
        """Return the initial state of the whole scene."""
        q, v = joint_start(Derivation(shortest), self.scene, program.factors)
        return {"initial_q": q, "initial_v": v}

    def rule(self, scenes: Sequence[Scene], _: int) -> Known:
        """Return the rule for places of the elements' middles, in the order of the term ``section_loads``."""
        middles = [_middles(scene) for scene in (*scenes, self.scene)]

        def middles_of_scene(samples: Samples) -> tuple[float, ...] | None:
            places = [tuple(item for item in sample if isinstance(item, float)) for sample in samples]
            return middles[3] if places == middles[:3] else None

        return middles_of_scene

    def sample(self, parts: int, missing: int, _: dict[object, Any]) -> Sample:
        """Return the sample of a scene; runs of 80 groups have all loops of longer ones."""
        return WHOLE if parts >= _FEW_OF_OTHERS else Sample(parts, missing)

    def find(self, scene: Scene) -> EqualParts | None:
        """Return the runs of a shorter scene."""
        return _find_runs(scene)


def equal_elements(scene: Scene) -> EqualElements | None:
    """Return the runs of equal elements of a scene; None if the runs are short, or if the scene names elements by
    number or place, constrains bodies, or carries one beam by another."""
    alike = _find_runs(scene)
    return alike if alike is not None and alike.plans else None


def _find_runs(scene: Scene) -> EqualElements | None:
    """Return the runs of equal elements of a scene as ``equal_elements`` does, short ones too."""
    beams = _beams(scene)
    if not beams or not _is_plain(scene):
        return None
    nodes = {node for beam in beams for node in beam.nodes[1:]}
    mentioned = _texts_outside_beams(scene, nodes)
    carriers = {joint.child: joint.parent for joint in scene.joints}
    if mentioned is None or not nodes.isdisjoint(carriers.get(beam.name, "") for beam in beams):
        return None
    return EqualElements(scene, tuple((beam, run) for beam in beams for run in _runs(beam, mentioned)))


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
    texts: dict[str, str] = {}
    rename(apart, lambda name: texts.setdefault(name, name))
    return None if _BY_ELEMENT & texts.keys() else {*texts}


def _runs(beam: Cosserat, mentioned: set[str]) -> Iterator[EqualGroups]:
    """Yield the runs of equal groups of elements of a beam; nodes with names in ``mentioned`` are between two runs."""
    kinds = _kinds(beam.parts)
    ends = [number for number, node in enumerate(beam.nodes) if node in mentioned and 0 < number < beam.elements]
    for first, end in pairwise((0, *ends, beam.elements)):
        yield from find_runs(first, end, partial(_groups, kinds, end))


def _kinds(parts: Sequence[BeamElement]) -> list[int]:
    """Return a number for each element, the same for equal elements."""
    numbers: dict[BeamElement, int] = {}
    by_object = {
        id(part): numbers.setdefault(part, len(numbers)) for part in {id(part): part for part in parts}.values()
    }
    return [by_object[id(part)] for part in parts]


def _groups(kinds: Sequence[int], end: int, start: int, period: int) -> int:
    """Return the number of equal groups of ``period`` items from ``start`` to before ``end``, at least 1."""
    alike = takewhile(lambda number: kinds[number] == kinds[number + period], range(start, end - period))
    return 1 + sum(1 for _ in alike) // period


def _beams(scene: Scene) -> list[Cosserat]:
    return [item.beam for item in scene.elements if isinstance(item, CosseratBeam)]


def _middles(scene: Scene) -> tuple[float, ...]:
    """Return the places of the elements' middles at rest, in the order of the term ``section_loads``."""
    return tuple(0.5 * (start + end) for beam in _beams(scene) for start, end in pairwise(beam.places))
