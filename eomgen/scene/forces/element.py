"""The contract of a force element: attributes and methods that the package calls on an element of a Scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Self

from eomgen.base.data import dataclass, replace
from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.design_poses import attach
from eomgen.scene.joints.model import Frame
from eomgen.system.description import Line, Wheel

#: From the parts of a key, body and position of a place to the equivalent body and position.
Attach = Callable[[tuple[str, ...], str, Vector], tuple[str, Vector]]


@dataclass(frozen=True)
class ForceElement:
    """A force element of a Scene. A kind overrides only the properties that apply.

    Attributes
    ----------
    section : of a scene file
    law : module and name of the ``mechanics.forces.loads.Law`` of the element's loads, ``module:LAW``; mechanics
        imports the law
    added_masses : module and name of the function of algebra, element and number (of a formula of parameters) that
        returns the ``mechanics.tree.inertia.AddedMass`` that the element adds to a body; empty for none
    """

    name: str
    section: ClassVar[str]
    law: ClassVar[str]
    added_masses: ClassVar[str] = ""

    @property
    def label(self) -> str:
        """Name in messages and comments: ``torsion spring t``."""
        return f"{self.section.removesuffix('s').replace('_', ' ')} {self.name}"

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        """Yield the formulas of the state and of time in the element.

        Yields
        ------
        tuple of Formula and int
            Each formula with the number of time derivatives needed.
        """
        yield from ()

    def passive(self) -> Self | None:
        """Return the element without forces by formulas, which have no potential.

        Returns
        -------
        ForceElement or None
            None for an element with no other part.
        """
        return self

    @property
    def adds_mass_to(self) -> str:
        """The body to which the element adds mass, by ``added_masses``; empty for none."""
        return ""

    @property
    def touches(self) -> bool:
        """Whether the element has the frames, the shape and the surface of a rolling constraint."""
        return False

    def lengths(self) -> tuple[Formula, ...]:
        """Return the lengths of the element.

        Returns
        -------
        tuple of Formula
            Each in m: a free length, a radius, the components of a place at rest.
        """
        return ()

    def frames(self) -> tuple[Frame, Frame] | None:
        """Return the two frames between which the element acts."""
        return None

    def places(self) -> Iterator[tuple[tuple[str, ...], str, Vector]]:
        """Yield the places on bodies that the element holds directly, not by a named point; by default of both
        ``frames``, if there are any.

        Yields
        ------
        tuple of tuples of str, str and sequence
            Parts of the key below the element, as ``("first", "position")``, body, and position (3,) in the axes of the
            body, m, as formulas.
        """
        for side, frame in zip(("first", "second"), self.frames() or (), strict=False):
            yield (side, "position"), frame.body, frame.position

    def attached(self, at: Attach) -> Self:
        """Return the element with other places on bodies.

        Parameters
        ----------
        at : callable
            From parts of the key, as ``("first", "position")``, body, and position (3,), m, of a place, three
            arguments, to the body and the position that replace it.

        Returns
        -------
        ForceElement
            A copy, with the results of ``at``; by default for both ``frames``, in fields ``first`` and ``second``, and
            the element itself without frames. An element with other ``places`` overrides this method.
        """
        frames = self.frames()
        if frames is None:
            return self
        sides = zip(("first", "second"), frames, strict=True)
        moved: dict[str, Any] = {side: attach(frame, at, (side, "position")) for side, frame in sides}
        return replace(self, **moved)  # kinds with frames have these fields

    def angles(self) -> tuple[tuple[str, int], ...]:
        """Return the angles on which the element depends as numbers, so that whole turns matter.

        Returns
        -------
        tuple of tuples of str and int
            Joint and index of each.
        """
        return ()

    def drawn(self) -> Line | Wheel | None:
        """Return the line or wheel that represents the element in pictures; None for an element without a picture."""
        return None
