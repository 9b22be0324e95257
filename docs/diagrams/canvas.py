"""A drawing of 400 units of width, with the signs of mechanics: arrows, springs, dampers, frames, dimensions, plots."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from html import escape

Point = tuple[float, float]

INK, GREY = "#22303c", "#6b7780"
#: Bodies and their frames; forces and efforts; dimensions and results.
BODY, FRAME, FORCE, MEASURE = "#d8e7f1", "#155e8a", "#b4450b", "#2e6b30"
WIDTH, SIZE = 400.0, 13.0
#: Width of a letter, in parts of its size, of the widest sans serif fonts of browsers.
LETTER = 0.56


def number(value: float) -> str:
    """Return a coordinate with one decimal, the same on every machine."""
    text = f"{value:.1f}"
    return "0" if text in ("0.0", "-0.0") else text.removesuffix(".0")


def around(x: float, y: float, radius: float, degrees: float) -> Point:
    """Return a point on a circle; angles count from x to the left turn, y down."""
    return x + radius * math.cos(math.radians(degrees)), y - radius * math.sin(math.radians(degrees))


def parts_of(text: str) -> Iterator[tuple[str, bool]]:
    """Yield pieces of a label and whether they are subscripts: ``k_1``, ``q_{elbow}``."""
    for piece in re.split(r"(_\{[^}]*\}|_\w)", text):
        if piece:
            yield (piece[2:-1] if piece.startswith("_{") else piece[1:], True) if piece[0] == "_" else (piece, False)


def length_of(text: str, size: float = SIZE) -> float:
    """Return a bound of the width of a label."""
    return sum(len(piece) * LETTER * size * (0.75 if below else 1.0) for piece, below in parts_of(text))


class Canvas:
    """Elements of a picture in their order; y points down, as in SVG."""

    def __init__(self, height: float) -> None:
        self.height = height
        self.elements: list[str] = []
        #: Left, top, right and bottom of each label.
        self.labels: list[tuple[str, float, float, float, float]] = []

    def svg(self, title: str) -> str:
        """Return the picture as a file, with a title for readers of screens."""
        size = f"{number(WIDTH)} {number(self.height)}"
        head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" width="480" role="img"'
        head += f' height="{number(1.2 * self.height)}" font-family="Helvetica, Arial, sans-serif" font-size="13">'
        paper = f'<rect width="{number(WIDTH)}" height="{number(self.height)}" fill="#fff"/>'
        return "\n".join([head, f"<title>{escape(title)}</title>", paper, *self.elements, "</svg>"]) + "\n"

    def _put(self, tag: str, **attributes: float | str) -> None:
        values = {name.rstrip("_").replace("_", "-"): it for name, it in attributes.items()}
        texts = (f'{name}="{it if isinstance(it, str) else number(it)}"' for name, it in values.items() if it != "")
        self.elements.append(f"<{tag} {' '.join(texts)}/>")

    def line(self, *points: Point, color: str = INK, width: float = 1.5, dash: str = "", fill: str = "none") -> None:
        """Draw straight lines between points; a filled one is closed."""
        path = "M" + " L".join(f"{number(x)} {number(y)}" for x, y in points) + ("Z" if fill != "none" else "")
        self._put("path", d=path, fill=fill, stroke=color, stroke_width=width, stroke_dasharray=dash,
                  stroke_linejoin="round")  # fmt: skip

    def curve(self, function: Callable[[float], Point], start: float, end: float, count: int = 60,
              color: str = INK, width: float = 2.0, dash: str = "", fill: str = "none") -> None:  # fmt: skip
        """Draw a curve by its points at parameters from start to end."""
        places = (start + (end - start) * k / count for k in range(count + 1))
        self.line(*(function(place) for place in places), color=color, width=width, dash=dash, fill=fill)

    def circle(self, x: float, y: float, radius: float, fill: str = "#fff", color: str = INK, width: float = 1.5,
               dash: str = "") -> None:  # fmt: skip
        """Draw a circle."""
        self._put("circle", cx=x, cy=y, r=radius, fill=fill, stroke=color, stroke_width=width, stroke_dasharray=dash)

    def dot(self, x: float, y: float, color: str = INK) -> None:
        """Draw a point."""
        self.circle(x, y, 3.2, color, color)

    def box(self, x: float, y: float, width: float, height: float, *lines: str, fill: str = "#fff",
            color: str = INK, size: float = SIZE) -> None:  # fmt: skip
        """Draw a rectangle with lines of text in its middle."""
        self._put("rect", x=x, y=y, width=width, height=height, rx=4.0, fill=fill, stroke=color, stroke_width=1.5)
        top = y + height / 2.0 - (len(lines) - 1) * 8.0 + 4.5
        for place, text in enumerate(lines):
            self.text(x + width / 2.0, top + 16.0 * place, text, size=size)

    def text(
        self, x: float, y: float, label: str, color: str = INK, anchor: str = "middle", size: float = SIZE
    ) -> None:
        """Write a label with subscripts; anchor is ``start``, ``middle`` or ``end``."""
        width = length_of(label, size)
        left = x - {"start": 0.0, "middle": width / 2.0, "end": width}[anchor]
        self.labels.append((label, left, y - 0.8 * size, left + width, y + 0.25 * size))
        pieces, lowered = [], False
        for piece, below in parts_of(label):
            shift = "" if below == lowered else f' dy="{"4" if below else "-4"}"'
            small = f' font-size="{number(0.75 * size)}"' if below else ""
            pieces.append(f"<tspan{shift}{small}>{escape(piece, quote=False)}</tspan>")
            lowered = below
        inner = "".join(pieces) if len(pieces) > 1 else escape(label, quote=False)
        other = f' font-size="{number(size)}"' if size != SIZE else ""
        place = f'x="{number(x)}" y="{number(y)}"'
        self.elements.append(f'<text {place} text-anchor="{anchor}" fill="{color}"{other}>{inner}</text>')

    def arrow(self, start: Point, end: Point, color: str = INK, width: float = 1.8, head: float = 8.0) -> None:
        """Draw an arrow."""
        (x, y), (u, v) = start, end
        size = math.hypot(u - x, v - y)
        a, b = (u - x) / size, (v - y) / size
        neck = (u - head * a, v - head * b)
        self.line(start, neck, color=color, width=width)
        wing = 0.45 * head
        self.line(end, (neck[0] - wing * b, neck[1] + wing * a), (neck[0] + wing * b, neck[1] - wing * a),
                  color=color, width=0.5, fill=color)  # fmt: skip

    def span(self, start: Point, end: Point, label: str = "", color: str = MEASURE, away: float = -7.0,
             anchor: str = "middle") -> None:  # fmt: skip
        """Draw a dimension: a line with heads at both ends, and its label above its middle."""
        middle = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0)
        self.arrow(middle, start, color, 1.2, 6.0)
        self.arrow(middle, end, color, 1.2, 6.0)
        if label:
            beside = 8.0 if anchor == "start" else -8.0 if anchor == "end" else 0.0
            self.text(middle[0] + beside, middle[1] + (4.0 if beside else away), label, color, anchor)

    def turn(self, x: float, y: float, radius: float, start: float, end: float, color: str = FORCE,
             width: float = 1.8) -> None:  # fmt: skip
        """Draw an arc with a head at its end, in degrees."""
        sign = 1.0 if end > start else -1.0
        last = end - sign * math.degrees(6.0 / radius)
        self.curve(lambda angle: around(x, y, radius, angle), start, last, 24, color, width)
        self.arrow(around(x, y, radius, last), around(x, y, radius, end), color, width, 7.0)

    def spring(self, start: Point, end: Point, coils: int = 6, high: float = 7.0, color: str = INK) -> None:
        """Draw a spring."""
        self._along(
            start, end, [(0.2 + 0.6 * (k + 0.5) / (2 * coils), high * (-1.0) ** k) for k in range(2 * coils)], color
        )

    def damper(self, start: Point, end: Point, high: float = 7.0, color: str = INK) -> None:
        """Draw a damper: a rod with its piston in a cup."""
        self._along(start, end, [(0.55, 0.0)], color, last=0.55)
        self._along(start, end, [(0.55, -0.7 * high), (0.55, 0.7 * high)], color, first=0.55, last=0.55)
        self._along(start, end, [(0.42, -high), (0.7, -high), (0.7, high), (0.42, high)], color, first=0.42, last=0.42,
                    ends=False)  # fmt: skip
        self._along(start, end, [(0.7, 0.0)], color, first=0.7)

    def _along(self, start: Point, end: Point, places: Sequence[tuple[float, float]], color: str, first: float = 0.0,
               last: float = 1.0, ends: bool = True) -> None:  # fmt: skip
        """Draw a line through places along and across the way from start to end."""
        (x, y), (u, v) = start, end
        size = math.hypot(u - x, v - y)
        a, b = (u - x) / size, (v - y) / size
        whole = [(first, 0.0), *places, (last, 0.0)] if ends else list(places)
        self.line(*((x + s * (u - x) - w * b, y + s * (v - y) + w * a) for s, w in whole), color=color)

    def ground(self, start: Point, end: Point, deep: float = 8.0) -> None:
        """Draw a fixed line with hatches on its right side on the way."""
        (x, y), (u, v) = start, end
        size = math.hypot(u - x, v - y)
        a, b = (u - x) / size, (v - y) / size
        self.line(start, end, width=1.8)
        for k in range(int(size // 8.0)):
            foot = 8.0 * k + 8.0
            at = (x + a * foot, y + b * foot)
            self.line(at, (at[0] - deep * (a + b), at[1] + deep * (a - b)), color=GREY, width=1.0)

    def link(self, start: Point, end: Point, width: float = 14.0, fill: str = BODY) -> None:
        """Draw a body as a bar with round ends."""
        (x, y), (u, v) = start, end
        direction = math.degrees(math.atan2(y - v, u - x))
        half = width / 2.0
        ends = [around(u, v, half, direction - 90.0 + 15.0 * k) for k in range(13)]
        starts = [around(x, y, half, direction + 90.0 + 15.0 * k) for k in range(13)]
        self.line(*ends, *starts, fill=fill)

    def frame(self, x: float, y: float, size: float = 34.0, turn: float = 0.0, names: Sequence[str] = ("x", "z"),
              color: str = FRAME) -> None:  # fmt: skip
        """Draw a right-handed frame in the plane, its first axis turned by degrees."""
        for angle, name in zip((turn, turn + 90.0), names, strict=True):
            self.arrow((x, y), around(x, y, size, angle), color, 1.6, 6.0)
            if name:
                u, v = around(x, y, size + 9.0, angle)
                self.text(u, v + 4.5, name, color)
        self.dot(x, y, color)

    def pin(self, x: float, y: float, radius: float = 5.0) -> None:
        """Draw a hinge."""
        self.circle(x, y, radius)
        self.circle(x, y, 1.2, INK)

    def plot(self, left: float, top: float, width: float, height: float, across: str, up: str,
             base: float = 1.0) -> Callable[[float, float], Point]:  # fmt: skip
        """Draw axes; return the place of a point whose coordinates are parts of the width and of the height.

        ``base`` is the height of the horizontal axis from the top, as a part.
        """
        level = top + base * height
        self.arrow((left, top + height), (left, top - 8.0), GREY, 1.2, 6.0)
        self.arrow((left, level), (left + width + 8.0, level), GREY, 1.2, 6.0)
        self.text(left + width + 8.0, level + 16.0, across, GREY, "end")
        self.text(left + 8.0, top + 1.0, up, GREY, "start")

        def place(x: float, y: float) -> Point:
            return left + width * x, level - height * y

        return place


def overlaps(labels: Sequence[tuple[str, float, float, float, float]], height: float) -> list[str]:
    """Return labels that leave the picture, and pairs of labels that meet."""
    found = [
        f"{text!r} leaves the picture"
        for text, left, top, right, bottom in labels
        if left < 0.0 or top < 0.0 or right > WIDTH or bottom > height
    ]
    for place, (text, left, top, right, bottom) in enumerate(labels):
        for other, left_, top_, right_, bottom_ in labels[place + 1 :]:
            if left < right_ and left_ < right and top < bottom_ and top_ < bottom:
                found.append(f"{text!r} meets {other!r}")
    return found


def steps(values: Sequence[float]) -> list[Point]:
    """Return the corners of a staircase through values at 0, 1, 2, ..."""
    return [(float(k + more), value) for k, value in enumerate(values) for more in (0, 1)]
