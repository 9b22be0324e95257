"""Sections of force elements: from entries of a scene file to elements of one kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.messages import key_of
from eomgen.errors import Problem, UsageError
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.formula.scope import ElementQuantity
from eomgen.scene.joints.frames import Site, site_of
from eomgen.scene.section import Reading, Section


@dataclass(frozen=True, eq=False, kw_only=True)
class ElementSection(Section):
    """A section whose entries are force elements of one kind.

    Attributes
    ----------
    model : class of the elements
    reader : from name, entry and site to the element
    offers : quantities of an element for formulas (``length.strut``), with the kind in scopes: ``element``, or
        ``tension`` of quantities that the force of a spring must not depend on
    """

    model: type[ForceElement]
    reader: Callable[[str, Any, Site], ForceElement]
    offers: Mapping[str, str] = field(default_factory=dict)
    after: tuple[str, ...] = ("controllers",)
    attached: bool = True
    scene_field: str = "elements"

    def names(self, reading: Reading) -> Mapping[str, Any]:
        """Return the quantities that formulas may read of the elements.

        Parameters
        ----------
        reading : Reading
            State of reading.

        Returns
        -------
        mapping
            Only the field ``offered`` of ``SceneNames``: by kind of quantity, the key of the section, the kind in
            scopes and the names of all elements, refused ones included; empty without elements.
        """
        names = reading.names_in(self.key)
        # schemas that are kept have all sections, with or without entries
        return {"offered": {kind: ElementQuantity(self.key, of, names) for kind, of in self.offers.items() if names}}

    def read_entry(self, name: str, entry: Any, reading: Reading) -> ForceElement:
        """Return the force element of an entry, with its places on bodies.

        Parameters
        ----------
        name : str
            Name of the entry.
        entry : Table
            The entry, checked by its schema.
        reading : Reading
            State of reading, to whose report faults of the entry go.

        Returns
        -------
        ForceElement
            The element, with places in the axes of its bodies, m; a place on a geometrically exact beam is on a node.

        Raises
        ------
        UsageError
            The reader of the section returns an object of another class than ``model``.
        """
        key = partial(key_of, self.key, name)
        element = self.reader(name, entry, site_of(reading))
        if not isinstance(element, self.model):
            module, kind = self.reader.__module__, type(element).__qualname__
            fault = f"{module}.{self.reader.__qualname__} returns a {kind}, not a {self.model.__qualname__} [E2220]"
            raise UsageError(Problem(key(), fault, "another version of the distribution that brings it"))
        return element.attached(lambda parts, *position: reading.attach(key(*parts), *position))
