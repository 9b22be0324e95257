"""Applied forces by virtual work: of force elements, by the register of their laws, of joints and of beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.mechanics.forces import (
    bushings,
    cosserat_beams,
    distributed_loads,
    efforts,
    forces,
    hulls,
    springs,
    torsion_springs,
    tyres,
)
from eomgen.mechanics.forces.beams import add_structure
from eomgen.mechanics.forces.joints import add_joint
from eomgen.mechanics.forces.loads import Law, Loads, no_loads
from eomgen.mechanics.forces.symbols import Offers, Quantities
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.scene import Scene

#: The laws of force elements in the order in which they are recorded, those before and those after the joints' own
#: forces.
LAWS: tuple[tuple[Law, ...], tuple[Law, ...]] = (
    (springs.LAW, forces.LAW, distributed_loads.LAW),
    (torsion_springs.LAW, bushings.LAW, tyres.LAW, efforts.LAW, hulls.LAW),
)
#: The laws of forces that entries of other sections bring with them.
STRUCTURE: tuple[Law, ...] = (cosserat_beams.LAW,)
OFFERED: Offers = {
    kind: (law.model.section, offer) for laws in LAWS for law in laws for kind, offer in law.offers.items()
}


def applied_loads(scene: Scene, tree: Tree, quantities: Quantities) -> Loads:
    """Return all applied loads on the tree, without gravity."""
    loads = no_loads(tree)
    before, after = LAWS
    _add_elements(loads, STRUCTURE, scene, quantities)
    _add_elements(loads, before, scene, quantities)
    for joint in scene.joints:
        add_joint(loads, joint, quantities)
    for link in tree.links:
        if link.elastic is not None:
            with tree.algebra.tape.block(f"stiffness and damping of {link.name}"):
                add_structure(loads, link.elastic, quantities)
    _add_elements(loads, after, scene, quantities)
    return loads


def _add_elements(loads: Loads, laws: tuple[Law, ...], scene: Scene, quantities: Quantities) -> None:
    for law in laws:
        elements: Sequence[Any] = [element for element in scene.elements if isinstance(element, law.model)]
        if law.together is not None and elements:
            elements = law.together(loads, elements, quantities)
        for element in elements:
            with quantities.algebra.tape.block(element.label):
                law.add(loads, element, quantities)
