"""Strains and loads of the sections of geometrically exact beams, as formulas call them and as a term."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.cosserat_beams import Chain, Element
from eomgen.mechanics.forces.element_loads import Fields, loads_on_halves
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.bodies.cosserat import SECTION_ROW, Cosserat
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar

#: Multipliers of the strains that a beam does not have, by element.
Multipliers = Callable[[Cosserat], Sequence[Sequence[Scalar]]]


class SectionLoads:
    """Strains and loads of the elements of each beam, recorded at their first use.

    Parameters
    ----------
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
        """Return for each element of a beam the numbers of ``Element.sections``, the first 24 of a ``SECTION_ROW``."""
        if name not in self._found:
            beam = self._beams[name]

            def sections(element: Element, *multipliers: Scalar) -> list[Scalar]:
                return element.sections(dict(zip(beam.constrained, multipliers, strict=True)))

            label = f"sections of beam {name}"
            with self._quantities.algebra.tape.block(label):
                elements = Chain.of(self._quantities, beam)
                more = self._multipliers(beam) if beam.constrained else ()
                self._found[name] = elements.each(sections, label, more)
        return self._found[name]

    def halves(self, name: str) -> list[list[Scalar]]:
        """Return the wrenches on the halves of each element of a beam, (12,); see ``loads_on_halves``."""
        if name not in self._halves:
            with self._quantities.algebra.tape.block(f"loads on the elements of beam {name}"):
                self._halves[name] = loads_on_halves(self._quantities, self._beams[name], self._fields())
        return self._halves[name]

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return a number of an element, given its position after the numbers of the elements before."""
        element, place = divmod(symbol.index, SECTION_ROW)
        row = self.rows(symbol.name)[element]
        if place < len(row):
            return row[place]
        exerted, acting = row[place - 12], self.halves(symbol.name)[element][place - 24]
        return exerted + acting if place < 30 else exerted - acting
