"""Section loads of geometrically exact beams.

Elements transmit one wrench from node to node, and loads along elements are lumped at the nodes. The section wrench at
a node is the wrench at the element's end plus the loads on half of the element. It is of second order in the element's
length, and equals the reaction at a clamp exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, cast

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.cosserat_beams import Chain, ElementStrain
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import AccelerationField, Wrench
from eomgen.mechanics.tree.inertia import inertia_about_center, wrench
from eomgen.mechanics.tree.links import Mount
from eomgen.scene.bodies.cosserat import SECTION_ROW, BeamSection, Cosserat
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, apply, multiply, transpose

if TYPE_CHECKING:
    from eomgen.scene.forces.distributed_loads import DistributedLoad

#: Map from a link's index to the link's field of accelerations minus gravity; negative indices denote the carrier of
#: the tree.
Fields = Callable[[int], AccelerationField]


def loads_on_halves(quantities: Quantities, beam: Cosserat, fields: Fields) -> list[list[Scalar]]:
    """Return for each element the wrenches of loads and inertia on the first and the second half, (12,), each about the
    node of this half. Moments, N m, before forces, N, in the axes of the node. ``fields`` gives the acceleration field
    of a link."""
    mounts = [quantities.tree.mounts[name] for name in beam.nodes]
    halves = [[quantities.algebra.zero] * 12 for _ in beam.parts]
    for element, part in enumerate(beam.parts):
        for end in (0, 1):
            inertia = _inertia_force(quantities, part.half(end), mounts[element + end], fields)
            half = 0.5 * float(part.length)
            _add(halves[element], end, [-half * entry for entry in (*inertia[0], *inertia[1])])
    for item in quantities.scene.elements:
        if item.section == "distributed_loads" and cast("DistributedLoad", item).beam == beam.name:
            from eomgen.mechanics.forces.distributed_loads import wrenches_per_length  # noqa: PLC0415  # schemas

            load = cast("DistributedLoad", item)
            for number, per_length in enumerate(wrenches_per_length(load, quantities)):
                before, beyond = load.nodes[number].halves
                if number > 0:
                    _add(halves[number - 1], 1, [before * entry for entry in per_length])
                if number < beam.elements:
                    _add(halves[number], 0, [beyond * entry for entry in per_length])
    return halves


def _add(halves: list[Scalar], end: int, load: Sequence[Scalar]) -> None:
    for index, entry in enumerate(load, 6 * end):
        halves[index] = halves[index] + entry


def _inertia_force(quantities: Quantities, section: BeamSection, mount: Mount, fields: Fields) -> Wrench:
    """Return the inertia wrench less the weight of a section per metre, moment first, in the node's axes; N and N/m."""
    algebra, field, axes = quantities.algebra, fields(mount.link), mount.orientation
    back = transpose(axes)
    tensor = tuple(quantities.formula(entry) for entry in (*section.rotary_inertia, *section.products))
    y, z = (quantities.formula(entry) for entry in section.center_of_mass)
    mass = quantities.formula(section.mass_per_length)
    inertia = inertia_about_center(algebra, mass, (algebra.zero, y, z), tensor)
    symmetric = multiply(multiply(back, field.symmetric), axes)
    return wrench(algebra, inertia, apply(back, field.at(mount.position)), apply(back, field.alpha), symmetric)


#: Multipliers of the strains that a beam does not have, by element.
Multipliers = Callable[[Cosserat], Sequence[Sequence[Scalar]]]


class RecordedSectionLoads:
    """Values of section loads in formulas: strains and loads of the elements of each beam, recorded at the first use.

    Parameters
    ----------
    multipliers : gives the multipliers of a beam's constrained strains, N, a list for each element
    fields : gives the links' accelerations less gravity
    """

    def __init__(
        self, scene: Scene, quantities: Quantities, multipliers: Multipliers, fields: Callable[[], Fields]
    ) -> None:
        self._beams = {item.name: item.beam for item in scene.elements if isinstance(item, CosseratBeam)}
        self._quantities, self._multipliers = quantities, multipliers
        self._fields = fields
        self._found: dict[str, list[list[Scalar]]] = {}
        self._halves: dict[str, list[list[Scalar]]] = {}

    @property
    def beams(self) -> tuple[Cosserat, ...]:
        """The geometrically exact beams of the scene."""
        return tuple(self._beams.values())

    def rows(self, name: str) -> list[list[Scalar]]:
        """Return for each element of the named beam the 24 numbers of ``ElementStrain.sections``. These are the first
        of a ``SECTION_ROW``."""
        if name not in self._found:
            beam = self._beams[name]

            def sections(element: ElementStrain, *multipliers: Scalar) -> list[Scalar]:
                return element.sections(dict(zip(beam.absent_strains, multipliers, strict=True)))

            label = f"sections of beam {name}"
            with self._quantities.algebra.tape.block(label):
                elements = Chain.of(self._quantities, beam)
                more = self._multipliers(beam) if beam.absent_strains else ()
                self._found[name] = elements.each(sections, label, more)
        return self._found[name]

    def halves(self, name: str) -> list[list[Scalar]]:
        """Return the wrenches on the halves of each element of a beam, (12,); see ``loads_on_halves``."""
        if name not in self._halves:
            with self._quantities.algebra.tape.block(f"loads on the elements of beam {name}"):
                self._halves[name] = loads_on_halves(self._quantities, self._beams[name], self._fields())
        return self._halves[name]

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return a number of an element's section row; the index counts ``SECTION_ROW`` numbers for each earlier
        element. Numbers 0 to 23 are strains and loads of the element; later numbers are the loads at both nodes,
        corrected by the loads on the halves."""
        element, component = divmod(symbol.index, SECTION_ROW)
        row = self.rows(symbol.name)[element]
        if component < len(row):
            return row[component]
        exerted, acting = row[component - 12], self.halves(symbol.name)[element][component - 24]
        return exerted + acting if component < 30 else exerted - acting
