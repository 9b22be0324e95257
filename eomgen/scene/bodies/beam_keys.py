"""Keys of a geometrically exact beam, or of one of its parts before them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from eomgen.scene.bodies import beam_schema as written

#: Keys of a part beside which a key of the beam does not count.
_IN_PLACE_OF: Mapping[str, Sequence[str]] = {
    "stiffness": ("section", "stiffness_matrix"),
    "stiffness_matrix": ("section", "stiffness"),
    "mass_per_length": ("section", "inertia_matrix"),
    "rotary_inertia": ("section", "inertia_matrix"),
    "center_of_mass": ("section", "inertia_matrix"),
    "inertia_matrix": ("section", "mass_per_length", "rotary_inertia", "center_of_mass"),
}


@dataclass(frozen=True)
class Keys:
    """Keys of a beam, or of one of its parts; a key that the part does not give is read from the beam.

    Attributes
    ----------
    key, part_key : dotted keys of beam and part
    """

    key: str
    entry: written.Beam
    part_key: str = ""
    part: written.BeamPart | None = None

    @property
    def model(self) -> str:
        return str(self.entry.model)

    def __getitem__(self, field: str) -> Any:
        if self._own(field):
            return getattr(self.part, field)
        hidden = any(self._own(other) for other in _IN_PLACE_OF.get(field, ()))
        return None if hidden else getattr(self.entry, field)

    def of(self, field: str) -> str:
        """Return the dotted key under which a key is written."""
        return f"{self.part_key if self._own(field) else self.key}.{field}"

    def together(self, first: str, second: str) -> bool:
        """Return whether two keys are written in one table."""
        return self._own(first) == self._own(second)

    def _own(self, field: str) -> bool:
        return self.part is not None and getattr(self.part, field) is not None
