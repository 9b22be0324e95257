"""Applied forces by virtual work: of force elements, by the laws that their classes name, of joints and of beams."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Any

from eomgen.errors import Problem, UsageError
from eomgen.mechanics.forces.beams import add_structure
from eomgen.mechanics.forces.joints import add_joint
from eomgen.mechanics.forces.loads import Law, Loads, no_loads
from eomgen.mechanics.forces.symbols import Offers, Quantities
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.scene import Scene


def law_of(kind: type[ForceElement]) -> Law:
    """Return the law of a class of force elements, ``kind.law``, from its module.

    Raises
    ------
    UsageError
        If the module does not load, or has no law for this class: one of another distribution may be broken.
    """
    try:
        law = _loaded(kind.law)
    except Exception as error:  # any error of a module of another distribution
        raise _broken(kind, f"does not load: {type(error).__name__}: {error}") from error
    if not isinstance(law, Law) or law.model is not kind:
        raise _broken(kind, f"is no eomgen.mechanics.forces.loads.Law of {kind.__qualname__}")
    return law


@cache
def _loaded(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _broken(kind: type[ForceElement], fault: str) -> UsageError:
    text = f"the law {kind.law} of {kind.__module__}.{kind.__qualname__} {fault}"
    return UsageError(Problem(kind.section, text, "another version of the distribution that brings it"))


def laws_of(scene: Scene) -> list[Law]:
    """Return the laws of a scene's force elements in the order of their sections in the register."""
    return [law_of(kind) for kind in dict.fromkeys(type(element) for element in scene.elements)]


def offered_by(scene: Scene) -> Offers:
    """Return the quantities that a scene's force elements offer to formulas."""
    return {kind: (law.model.section, offer) for law in laws_of(scene) for kind, offer in law.offers.items()}


def applied_loads(scene: Scene, tree: Tree, quantities: Quantities) -> Loads:
    """Return all applied loads on the tree, without gravity."""
    loads = no_loads(tree)
    laws = laws_of(scene)
    _add_elements(loads, [law for law in laws if law.before_joints], scene, quantities)
    for joint in scene.joints:
        add_joint(loads, joint, quantities)
    for link in tree.links:
        if link.elastic is not None:
            with tree.algebra.tape.block(f"stiffness and damping of {link.name}"):
                add_structure(loads, link.elastic, quantities)
    _add_elements(loads, [law for law in laws if not law.before_joints], scene, quantities)
    return loads


def _add_elements(loads: Loads, laws: Sequence[Law], scene: Scene, quantities: Quantities) -> None:
    for law in laws:
        elements: Sequence[Any] = [element for element in scene.elements if isinstance(element, law.model)]
        if law.together is not None and elements:
            elements = law.together(loads, elements, quantities)
        for element in elements:
            with quantities.algebra.tape.block(element.label):
                law.add(loads, element, quantities)
