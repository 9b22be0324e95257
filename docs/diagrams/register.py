"""The register of diagrams: name of the page, height of the picture, and its text for readers who do not see it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from docs.diagrams.canvas import Canvas

Draw = Callable[[Canvas], None]


@dataclass(frozen=True)
class Diagram:
    """A diagram of a page.

    Attributes
    ----------
    page : str
        Name of the page in ``docs/scene``, without ending.
    height : float
        Of the picture, whose width is 400.
    text : str
        Alternative text.
    draw : callable
        Draws on a canvas.
    """

    page: str
    height: float
    text: str
    draw: Draw

    def canvas(self) -> Canvas:
        """Return the drawn picture."""
        canvas = Canvas(self.height)
        self.draw(canvas)
        return canvas

    def svg(self) -> str:
        """Return the file."""
        return self.canvas().svg(self.text)


DIAGRAMS: dict[str, Diagram] = {}


def drawing(page: str, height: float, text: str) -> Callable[[Draw], Draw]:
    """Add a function that draws the diagram of a page to the register."""

    def add(draw: Draw) -> Draw:
        DIAGRAMS[page] = Diagram(page, height, text, draw)
        return draw

    return add
