"""The picture of the rooms in docs/architecture.md, drawn from the imports: ``python -m tests.rooms docs/rooms.svg``
renews it.

An arrow leads from a room to one that it imports; arrows that follow from others are left out (transitive reduction),
and so are the rooms that everybody may import. The rooms of the core stand in one block, the trunk. A product registers
itself with the trunk, hence one arrow from its box to the block; the box lists the rooms and the products that it
imports.
"""

from __future__ import annotations

import sys
from html import escape
from pathlib import Path

from tests.test_doors import DOORS, PACKAGE, _own, room_of

#: Rooms that are at everybody's hand, drawn as one box without arrows.
BASE = ("base", "errors")
#: Entries of the table that are no rooms: the way in, and a stub for type checkers.
APART = ("__main__", "products.exported", "products.offered")
PRODUCTS = "products."
WIDTH, HEIGHT, GAP, RISE, MARGIN, LETTER = 1120.0, 40.0, 18.0, 48.0, 12.0, 6.3


def imported() -> dict[str, set[str]]:
    """Return the rooms and products that each room imports."""
    direct: dict[str, set[str]] = {room: set() for room in DOORS if room not in (*BASE, *APART)}
    for module, target, _ in _own():
        user, room = room_of(module), room_of(target)
        if user in direct and room in direct and user != room:
            direct[user].add(room)
    return direct


def arrows() -> dict[str, set[str]]:
    """Return the rooms of the core that each of them imports, without imports that follow from others."""
    every = imported()
    direct = {
        room: {to for to in targets if not to.startswith(PRODUCTS)}
        for room, targets in every.items()
        if not room.startswith(PRODUCTS)
    }

    def reached(room: str) -> set[str]:
        return set().union(*({other} | reached(other) for other in direct[room])) if direct[room] else set()

    below = {room: reached(room) for room in direct}
    return {
        room: {to for to in targets if not any(to in below[other] for other in targets)}
        for room, targets in direct.items()
    }


def levels(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the rooms level by level from the bottom; a room stands above all that it imports, near what it
    imports."""

    def level(room: str) -> int:
        return 1 + max((level(other) for other in graph[room]), default=-1)

    rows: list[list[str]] = [[] for _ in range(1 + max(map(level, graph)))]
    for room in sorted(graph):
        rows[level(room)].append(room)
    place = {room: float(number) for row in rows for number, room in enumerate(row)}
    for row in rows[1:]:
        row.sort(key=lambda room: (sum(place[to] for to in graph[room]) / max(len(graph[room]), 1), room))
        place |= {room: float(number) for number, room in enumerate(row)}
    return rows


def parts(room: str) -> str:
    """Return the rooms within a room."""
    return ", ".join(sorted(path.parent.name for path in PACKAGE.joinpath(*room.split(".")).glob("*/__init__.py")))


def broken(words: list[str], letters: int) -> list[str]:
    """Return words in lines of at most some letters."""
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + len(word) > letters:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + word
    return [line for line in lines if line]


def lines_of(room: str) -> list[str]:
    """Return a room's inner rooms in lines of some 34 letters."""
    return broken(parts(room).split(", ") if parts(room) else [], 34)


def product_lines(product: str) -> list[str]:
    """Return the lines in the box of a product: its inner rooms, and the rooms and products that it imports."""
    names = sorted(imported()[product])
    core = [f"imports {names[0]}", *names[1:]]
    others = [room.removeprefix(PRODUCTS) for room in names if room.startswith(PRODUCTS)]
    core = [room for room in core if not room.startswith(PRODUCTS)]
    inner = parts(product).split(", ") if parts(product) else []
    return [line for words in (inner, core, [f"and {name}" for name in others]) for line in broken(words, 21)]


def drawing() -> str:
    """Return the picture as SVG."""
    graph = arrows()
    rows = levels(graph)
    sizes = {}
    for room in graph:
        longest = max(map(len, (room, *lines_of(room))))
        sizes[room] = (max(24.0 + 1.05 * LETTER * longest, 84.0), HEIGHT + 12.0 * len(lines_of(room)))
    heights = [max(sizes[room][1] for room in row) for row in rows]
    products = sorted(room for room in DOORS if room.startswith(PRODUCTS) and room not in APART)
    across = (WIDTH - GAP * (len(products) - 1) - 2 * MARGIN) / len(products)
    tall = max(HEIGHT + 12.0 * len(product_lines(product)) for product in products)
    trunk = sum(heights) + RISE * (len(rows) - 0.5) + 2 * GAP
    total = 2 * MARGIN + tall + RISE + trunk + 0.5 * RISE + HEIGHT
    boxes: dict[str, tuple[float, float, float, float]] = {}
    y = total - MARGIN - HEIGHT
    texts = [_box(MARGIN, y, WIDTH - 2 * MARGIN, HEIGHT, ", ".join(BASE), ["every room may import these"])]
    top = MARGIN + tall + RISE
    texts.append(
        f'<rect x="{MARGIN:.0f}" y="{top:.0f}" width="{WIDTH - 2 * MARGIN:.0f}" height="{trunk:.0f}" rx="9" '
        'fill="#f8fafb" stroke="#2f4858" stroke-dasharray="5 4"/>'
        f'<text x="{MARGIN + 14:.0f}" y="{top + 20:.0f}" font-size="13" text-anchor="start" '
        'fill="#12202b">the core</text>'
    )
    for number, product in enumerate(products):
        x = MARGIN + number * (across + GAP)
        name = product.removeprefix(PRODUCTS)
        texts.append(_box(x, MARGIN, across, tall, name, product_lines(product)))
        texts.append(_arrow(x + 0.5 * across, MARGIN + tall, x + 0.5 * across, top))
    y -= 0.5 * RISE + GAP
    for row, height in zip(rows, heights, strict=True):
        y -= height + (0.0 if row is rows[0] else RISE)
        widths = [sizes[room][0] for room in row]
        gap = (WIDTH - sum(widths)) / (len(row) + 1)
        x = gap
        for room, width in zip(row, widths, strict=True):
            boxes[room] = (x, y + height - sizes[room][1], width, sizes[room][1])
            x += width + gap
    for room in sorted(graph):
        for number, to in enumerate(sorted(graph[room], key=lambda name: (boxes[name][0], name))):
            x, upper, width, height = boxes[room]
            share = (number + 1) / (len(graph[room]) + 1)
            users = sorted((name for name in graph if to in graph[name]), key=lambda name: boxes[name][0])
            at = (users.index(room) + 1) / (len(users) + 1)
            texts.append(_arrow(x + share * width, upper + height, boxes[to][0] + at * boxes[to][2], boxes[to][1]))
    texts += [_box(*boxes[room], room, lines_of(room)) for room in sorted(graph)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {total:.0f}" '
        'font-family="sans-serif" text-anchor="middle">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#5b7083"/></marker></defs>'
        f'<rect width="{WIDTH:.0f}" height="{total:.0f}" fill="#ffffff"/>'
    )
    return "\n".join([head, *texts, "</svg>"]) + "\n"


def _arrow(x1: float, y1: float, x2: float, y2: float) -> str:
    bend = 0.5 * (y2 - y1)
    return (
        f'<path d="M{x1:.0f} {y1:.0f} C{x1:.0f} {y1 + bend:.0f} {x2:.0f} {y2 - bend:.0f} {x2:.0f} {y2:.0f}" '
        'fill="none" stroke="#5b7083" marker-end="url(#tip)"/>'
    )


def _box(x: float, y: float, width: float, height: float, name: str, lines: list[str]) -> str:
    middle = x + width / 2
    found = [
        (
            f'<rect x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" rx="5" fill="#eef3f7"'
            ' stroke="#2f4858"/>'
        ),
        (
            f'<text x="{middle:.0f}" y="{y + (17 if lines else 24):.0f}" font-size="13"'
            f' fill="#12202b">{escape(name)}</text>'
        ),
    ]
    found += [
        f'<text x="{middle:.0f}" y="{y + 30 + 12 * number:.0f}" font-size="10" fill="#43596b">{escape(line)}</text>'
        for number, line in enumerate(lines)
    ]
    return "\n".join(found)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(drawing(), encoding="utf-8")
