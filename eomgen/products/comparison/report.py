"""Results of a comparison: differences with places, and the text of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.base.calls import unknown_attribute
from eomgen.base.data import asdict, dataclass
from eomgen.base.messages import counted


@dataclass(frozen=True)
class Difference:
    """One quantity that two descriptions give differently.

    Attributes
    ----------
    element : str
        Section and name in the first description, ``bodies.arm`` or ``joints.hinge``.
    quantity : str
        ``mass``, ``center_of_mass``, ``inertia``, ``type``, ``position``, ``axis``, ``damping`` and more; ``mass
        matrix``, ``bias`` and ``force`` for terms of the equations of motion.
    first, second : float, str or tuple
        Values in SI units; vectors and inertias (xx, yy, zz, xy, xz, yz) in the frame of the first description. None if
        the element is absent.
    unit : str
    places : tuple of str
        ``file:line`` in both descriptions; empty if unknown.
    """

    element: str
    quantity: str
    first: Any
    second: Any
    unit: str = ""
    places: tuple[str, str] = ("", "")

    def __getattr__(self, name: str) -> Any:
        raise unknown_attribute(self, name)

    @property
    def texts(self) -> tuple[str, str]:
        """Both values as text."""
        return _text(self.first), _text(self.second)

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        where = " and ".join(location for location in self.places if location)
        text = f"{self.element}: {self.quantity} is {self.texts[0]} and {self.texts[1]}{unit}"
        return f"{text}{f' ({where})' if where else ''}"


@dataclass(frozen=True)
class Comparison:
    """Result of ``compare``.

    Attributes
    ----------
    names : tuple of str
        Of both descriptions.
    differences : tuple of Difference
        Structure first, then link by link from the base outwards, limits and friction at the end, and terms of the
        equations of motion if no quantity of the descriptions explains the error.
    errors : mapping
        Largest relative difference over all states of ``mass matrix``, ``bias``, ``force`` and ``sum``; empty if the
        coordinates of both descriptions do not match.
    states : int
        Number of random states.
    matched : int
        Number of joints in both descriptions.
    tolerance : float
        Largest relative difference that counts as none.
    notes : tuple of str
        On parts that were not compared.
    """

    names: tuple[str, str]
    differences: tuple[Difference, ...]
    errors: Mapping[str, float]
    states: int
    matched: int
    tolerance: float
    notes: tuple[str, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether no difference was seen."""
        return not self.differences

    @property
    def first(self) -> Difference | None:
        """The first difference; None if there is none."""
        return self.differences[0] if self.differences else None

    @property
    def summary(self) -> str:
        """One sentence: the number of differences and the first of these, or equality, and the ``errors`` at the random
        states, if equations were compared."""
        terms = ", ".join(f"{name} {error:.1e}" for name, error in self.errors.items())
        measured = f"; largest relative differences at {self.states} random states: {terms}" if terms else ""
        if self.first is None:
            joints = counted(self.matched, "joint")
            return f"{self.names[0]} and {self.names[1]} are equal in {joints} and the moved bodies{measured}"
        return f"{counted(len(self.differences), 'difference')}, the first: {self.first}{measured}"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data.

        Returns
        -------
        dict
            The attributes, with ``equal`` and ``summary``.
        """
        return {"equal": self.equal, "summary": self.summary, **asdict(self)}

    def __str__(self) -> str:
        lines = [
            self.summary,
            *(f"  {item}" for item in self.differences[1:]),
            *(f"note: {note}" for note in self.notes),
        ]
        return "\n".join(lines)


def _text(value: Any) -> str:
    """Return a quantity of a difference as text: numbers with nine digits, the first ones of a sequence with six, and
    ``absent`` for None."""
    if value is None:
        return "absent"
    if isinstance(value, str):
        return value or "none"
    if isinstance(value, tuple | list):
        shown = ", ".join(f"{item:.6g}" for item in value[:9])
        return f"({shown}{', ...' if len(value) > 9 else ''})"
    return f"{value:.9g}"
