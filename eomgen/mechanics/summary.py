"""Summary of a derivation, present and omitted terms, for ``eomgen info`` and the README."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.mechanics.tree.links import Tree
from eomgen.scene.bodies.cosserat import CONSTRAINED
from eomgen.scene.bodies.model import KINDS, Beam
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.system.system import Facts, Function


def kept_and_dropped(
    scene: Scene, tree: Tree, functions: Mapping[str, Function], facts: Facts
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return two lists of sentences: effects in the equations, and effects omitted as the scene has none of them."""
    kept: list[str] = [f"{name}: {function.description}" for name, function in functions.items()]
    dropped: list[str] = []
    kept += [f"curve {curve.name}: {curve}" for curve in scene.curves]

    def note(present: bool, effect: str, why: str) -> None:
        if not present:
            dropped.append(f"{effect}: {why}")

    joints = scene.joints
    followers = [f"{joint.name} follows {joint.mimic.joint}" for joint in joints if joint.mimic is not None]
    if followers:
        dropped.append(f"coordinates of {len(followers)} joint(s) that follow others: {', '.join(followers)}")
    beams = {body.name: body.beam for body in scene.bodies if body.beam is not None}
    for name, beam in beams.items():
        kept.append(f"beam {name}: {_deformed(beam)}")
        lacking = [kind for kind in KINDS if kind not in {item.kind for item in beam.deformations}]
        note(not lacking, f"{', '.join(lacking)} of beam {name}", "the scene asks for none")
    for element in scene.elements:
        if isinstance(element, CosseratBeam):
            strain_names = ", ".join(strain.replace("_", " along ") for strain in CONSTRAINED[element.beam.model])
            without = f", without {strain_names}: {len(element.beam.constrained)} rows for each" if strain_names else ""
            kept.append(
                f"beam {element.beam.name}: model {element.beam.model}, {element.beam.elements} elements{without}"
            )
    fixed = [joint.name for joint in joints if not joint.kind.moves and joint.child not in beams]
    if fixed:
        dropped.append(f"{len(fixed)} fixed joint(s) merged into their parents: {', '.join(fixed)}")
    note(facts.moving_base, "base_motion, base struct", "the base is at rest")
    note(scene.base is None or bool(scene.base.rotations), "rotation of the base", "the base only translates")
    note(bool(scene.springs), "springs between points", "the scene has none")
    note(bool(scene.forces or scene.efforts), "forces and efforts by formula", "the scene has none")
    note(bool(scene.inputs), "inputs", "the scene has none")
    note(bool(scene.states), "internal states", "the scene has none")
    note(
        any(parameter.tunable for parameter in scene.parameters),
        "parameter struct",
        "all parameters are fixed and folded",
    )
    note(
        any(not rotor.is_zero for link in tree.links for rotor in link.rotor_inertias),
        "rotor inertia",
        "no joint has any",
    )
    note(facts.velocity_forces, "damping in the iteration matrix", "no applied force depends on velocity")
    note("outputs" in functions, "outputs", "not asked for" if scene.outputs else "the scene names none")
    for term in ("partials", "energy"):
        note(term in functions, term, "not asked for")
    return tuple(kept), tuple(dropped)


def _deformed(beam: Beam) -> str:
    ways = ", ".join(f"{item.modes} of {item.kind}" for item in beam.deformations)
    order = "to second order" if beam.order == 1 else "whole"
    shortening = "with" if beam.stiffening else "without"
    return f"elastic coordinates {ways}; kinetic energy {order} in them, {shortening} the shortening of the bent axis"
