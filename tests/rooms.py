"""The picture of the rooms in docs/architecture.md, drawn from the imports: ``python -m tests.rooms docs/rooms.svg``
renews it.

An arrow leads from a room to one that it imports; arrows that follow from others are left out (transitive reduction),
and so are the rooms that everybody may import. A product has one arrow, to the highest room of the core that it
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


def arrows() -> dict[str, set[str]]:
    """Return what each room imports, without what follows."""
    direct: dict[str, set[str]] = {room: set() for room in DOORS if room not in (*BASE, *APART)}
    for module, target, _ in _own():
        user, room = room_of(module), room_of(target)
        if user in direct and room in direct and user != room and not room.startswith(PRODUCTS):
            direct[user].add(room)

    def reached(room: str) -> set[str]:
        return set().union(*({other} | reached(other) for other in direct[room])) if direct[room] else set()

    below = {room: reached(room) for room in direct}
    graph = {
        room: {to for to in targets if not any(to in below[other] for other in targets)}
        for room, targets in direct.items()
    }
    return {
        room: {max(targets, key=lambda to: (len(below[to]), to))} if room.startswith(PRODUCTS) else targets
        for room, targets in graph.items()
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


def lines_of(room: str) -> list[str]:
    """Return a room's inner rooms in lines of some 34 letters."""
    lines = [""]
    for word in parts(room).split(", ") if parts(room) else []:
        if lines[-1] and len(lines[-1]) + len(word) > 34:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + word
    return [line for line in lines if line]


def drawing() -> str:
    """Return the picture as SVG."""
    graph = arrows()
    rows = levels(graph)
    sizes = {}
    for room in graph:
        longest = max(map(len, (room, *lines_of(room))))
        sizes[room] = (max(24.0 + 1.05 * LETTER * longest, 84.0), HEIGHT + 12.0 * len(lines_of(room)))
    heights = [max(sizes[room][1] for room in row) for row in rows]
    total = sum(heights) + RISE * len(rows) + HEIGHT + 2 * MARGIN
    boxes: dict[str, tuple[float, float, float, float]] = {}
    y = total - MARGIN - HEIGHT
    texts = [_box(MARGIN, y, WIDTH - 2 * MARGIN, HEIGHT, ", ".join(BASE), ["every room may import these"])]
    for row, height in zip(rows, heights, strict=True):
        y -= height + RISE * (0.5 if row is rows[0] else 1.0)
        widths = [sizes[room][0] for room in row]
        gap = (WIDTH - sum(widths)) / (len(row) + 1)
        x = gap
        for room, width in zip(row, widths, strict=True):
            boxes[room] = (x, y + height - sizes[room][1], width, sizes[room][1])
            x += width + gap
    for room in sorted(graph):
        for number, to in enumerate(sorted(graph[room], key=lambda name: (boxes[name][0], name))):
            x, top, width, height = boxes[room]
            share = (number + 1) / (len(graph[room]) + 1)
            users = sorted((name for name in graph if to in graph[name]), key=lambda name: boxes[name][0])
            at = (users.index(room) + 1) / (len(users) + 1)
            x1, y1 = x + share * width, top + height
            x2, y2 = boxes[to][0] + at * boxes[to][2], boxes[to][1]
            bend = 0.5 * (y2 - y1)
            texts.append(
                f'<path d="M{x1:.0f} {y1:.0f} C{x1:.0f} {y1 + bend:.0f} {x2:.0f} {y2 - bend:.0f} {x2:.0f} {y2:.0f}" '
                'fill="none" stroke="#5b7083" marker-end="url(#tip)"/>'
            )
    texts += [_box(*boxes[room], room, lines_of(room)) for room in sorted(graph)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {total:.0f}" '
        'font-family="sans-serif" text-anchor="middle">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#5b7083"/></marker></defs>'
        f'<rect width="{WIDTH:.0f}" height="{total:.0f}" fill="#ffffff"/>'
    )
    return "\n".join([head, *texts, "</svg>"]) + "\n"


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
