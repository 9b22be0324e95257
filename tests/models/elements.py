"""Force elements of scenes, by their sections."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from eomgen.scene.forces.element import ForceElement
from eomgen.scene.scene import Scene


def elements_with(scene: Scene, **sections: Iterable[ForceElement]) -> tuple[ForceElement, ...]:
    """Return the force elements of a scene with those of some sections in place of its own."""
    kept = (element for element in scene.elements if element.section not in sections)
    return (*kept, *chain.from_iterable(sections.values()))
