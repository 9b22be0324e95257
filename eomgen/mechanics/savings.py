"""Operations saved by each simplification, from the scene derived again without it, for ``eomgen info``."""

from __future__ import annotations

from typing import Any

from eomgen.base.data import dataclass, replace
from eomgen.errors import ModelError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Number, Symbol
from eomgen.mechanics.derive import derive
from eomgen.mechanics.tree.build import attached_along
from eomgen.scene.bodies.model import KINDS, Base, Beam, Body, Deformation
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.signals import Parameter

#: Terms that are compared; each is derived with and without.
COMPARED = ("mass", "inverse_dynamics", "forward_dynamics")


@dataclass(frozen=True)
class Saving:
    """Operation count (additions and multiplications) of one term, with and without one simplification."""

    what: str
    term: str
    operations: int
    without: int


def savings(scene: Scene) -> list[Saving]:
    """Return the differences of operation counts of three terms, from deriving the scene again without each
    simplification. Terms without a difference are left out, and simplifications without which the scene cannot be
    derived."""
    actual = derive(scene, COMPARED).counts
    differences = []
    for simplification, variant in _variants(scene):
        try:
            counts = derive(variant, COMPARED).counts
        except ModelError:  # a variant that cannot be derived has no cost to compare with
            continue
        pairs = [(term, actual[term].flops, counts[term].flops) for term in COMPARED if term in actual]
        differences += [Saving(simplification, term, kept, without) for term, kept, without in pairs if without != kept]
    return differences


def _variants(scene: Scene) -> list[tuple[str, Scene]]:
    """Return pairs of a text on a simplification and the scene without this simplification."""
    variants = [("inertial parameters folded and grouped", _with_tunable_inertia(scene))]
    if scene.base is None:
        moving = Base(rotations=(Rotation((0.6, 0.0, 0.8), Symbol("time")),))
        variants.append(("base at rest", replace(scene, base=moving)))
    along = _along_beams(scene)
    tunable = tuple(replace(parameter, tunable=parameter.name not in along) for parameter in scene.parameters)
    if tunable != scene.parameters:
        variants.append(("fixed parameters folded", replace(scene, parameters=tunable)))
    bodies = tuple(
        body if body.beam is None else replace(body, beam=_with_all_deformations(body.beam)) for body in scene.bodies
    )
    elastic = sum(body.beam.size for body in bodies if body.beam is not None)
    if bodies != scene.bodies and elastic <= 40:  # more would take long to derive
        variants.append(("beams deform only as the scene asks", replace(scene, bodies=bodies)))
    return variants


def _along_beams(scene: Scene) -> set[str]:
    """Return the names of parameters of positions on beams, which are not tunable: shape functions are evaluated
    there."""
    beams = (body.name for body in scene.bodies if body.beam is not None)
    return {symbol.name for beam in beams for _, x in attached_along(scene, beam) for symbol in symbols(x)}


def _with_all_deformations(beam: Beam) -> Beam:
    """Return the full spatial beam: for the missing kinds, the number of modes of the first kind."""
    kinds = {item.kind: item for item in beam.deformations}
    modes = beam.deformations[0].modes
    every = tuple(kinds.get(kind, Deformation(kind, "clamped_free", modes, Number(1.0))) for kind in KINDS)
    polar = Number(1.0) if beam.polar_inertia == Number(0.0) else beam.polar_inertia
    return replace(beam, deformations=every, polar_inertia=polar)


def _with_tunable_inertia(scene: Scene) -> Scene:
    """Return the scene with mass, centre of mass and inertia of all bodies as tunable parameters."""
    parameters: list[Parameter] = list(scene.parameters)
    bodies: list[Body] = []

    def tunable(name: str) -> Symbol:
        parameters.append(Parameter(name, 1.0, tunable=True))
        return Symbol("parameter", name)

    for number, body in enumerate(scene.bodies):
        values: Any = tuple(tunable(f"inertial {number} {k}") for k in range(10))
        bodies.append(replace(body, mass=values[0], center_of_mass=values[1:4], inertia=values[4:]))
    return replace(scene, parameters=tuple(parameters), bodies=tuple(bodies))
