"""The picture of the rooms in docs/architecture.md, drawn from the imports: ``python -m tests.rooms docs/rooms.svg``
renews it.

An arrow leads from a room to a room that it imports, through the gaps between boxes; arrows that follow from others are
left out (transitive reduction), and so are the rooms that everybody may import. The rooms of the core stand in one
block, the trunk. A product registers itself with the trunk, hence one arrow from its box to the block; the box lists
the rooms and the products that it imports.
"""

from __future__ import annotations

import sys
from html import escape
from itertools import combinations, pairwise
from pathlib import Path

from tests.test_doors import DOORS, PACKAGE, _own, room_of

#: Rooms that are at everybody's hand, drawn as one box without arrows.
BASE = ("base", "errors")
#: Entries of the table that are no rooms: the way in, and a stub for type checkers.
APART = ("__main__", "products.exported", "products.model_methods", "products.offered", "products.solution_methods")
PRODUCTS = "products."
Box = tuple[float, float, float, float]
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


def levels(graph: dict[str, set[str]]) -> dict[str, int]:
    """Return the level of each room from the bottom; a room stands above all that it imports, and arrows are short."""

    def lowest(room: str) -> int:
        return 1 + max((lowest(other) for other in graph[room]), default=-1)

    level = {room: lowest(room) for room in graph}
    for room in sorted(graph, key=lambda name: -level[name]):
        users = [level[name] for name in graph if room in graph[name]]
        if len(users) > len(graph[room]):
            level[room] = min(users) - 1
    return level


def layers(graph: dict[str, set[str]]) -> tuple[list[list[str]], list[tuple[str, str]]]:
    """Return the nodes of each level, and the links of nodes with nodes one level below.

    Nodes are rooms, and ``user>room>level`` for an arrow that passes a level.
    """
    level = levels(graph)
    rows: list[list[str]] = [[] for _ in range(1 + max(level.values()))]
    links = []
    for room in sorted(graph):
        rows[level[room]].append(room)
        for to in sorted(graph[room]):
            passed = [f"{room}>{to}>{number}" for number in range(level[room] - 1, level[to], -1)]
            for node in passed:
                rows[int(node.rpartition(">")[2])].append(node)
            links += pairwise([room, *passed, to])
    return rows, links


def crossings(rows: list[list[str]], links: list[tuple[str, str]]) -> int:
    """Return how many links cross."""
    place = {node: number for row in rows for number, node in enumerate(row)}
    height = {node: number for number, row in enumerate(rows) for node in row}
    return sum(
        height[a] == height[c] and (place[a] - place[c]) * (place[b] - place[d]) < 0
        for (a, b), (c, d) in combinations(links, 2)
    )


def untangled(rows: list[list[str]], links: list[tuple[str, str]]) -> list[list[str]]:
    """Return the rows in an order with few crossings: nodes near the mean place of their neighbours, then swaps of
    neighbours."""
    best = rows
    for sweep in range(16):
        place = {node: number / len(row) for row in rows for number, node in enumerate(row)}
        for row in rows if sweep % 2 else rows[::-1]:
            mean = {node: _mean_of_neighbours(node, links, place, below=sweep % 2 == 1) for node in row}
            row.sort(key=lambda node, mean=mean: (mean[node], node))  # type: ignore[misc]
            place |= {node: number / len(row) for number, node in enumerate(row)}
        if crossings(rows, links) < crossings(best, links) or best is rows:
            best = [list(row) for row in rows]
    better = True
    while better:
        better = False
        for row in best:
            for left in range(len(row) - 1):
                before = crossings(best, links)
                row[left : left + 2] = row[left + 1], row[left]
                if crossings(best, links) < before:
                    better = True
                else:
                    row[left : left + 2] = row[left + 1], row[left]
    return best


def _mean_of_neighbours(node: str, links: list[tuple[str, str]], at: dict[str, float], below: bool) -> float:
    ends = [at[b if below else a] for a, b in links if node == (a if below else b)]
    return sum(ends) / len(ends) if ends else at[node]


def middles(rows: list[list[str]], links: list[tuple[str, str]], widths: dict[str, float]) -> dict[str, float]:
    """Return the x of each node's middle: near its neighbours, in the order of the row, without overlap."""
    at = {}
    for row in rows:
        gap = (WIDTH - sum(widths[node] for node in row)) / (len(row) + 1)
        x = 0.0
        for node in row:
            at[node] = x + gap + widths[node] / 2
            x += gap + widths[node]
    for sweep in range(200):
        for row in rows if sweep % 2 else rows[::-1]:
            wished = []
            for node in row:
                ends = [at[b if a == node else a] for a, b in links if node in (a, b)]
                weight = 6.0 if ">" in node else 1.0  # an arrow that passes is straight
                wished.append((sum(ends) / len(ends), weight))
            at |= dict(zip(row, _apart([widths[node] for node in row], wished), strict=True))
    left = min(at[node] - widths[node] / 2 for node in at)
    right = max(at[node] + widths[node] / 2 for node in at)
    return {node: x + (WIDTH - left - right) / 2 for node, x in at.items()}


def _apart(widths: list[float], wished: list[tuple[float, float]]) -> list[float]:
    """Return middles near wished places, by weighted least squares, with gaps between all widths."""
    offsets = [0.0]
    for left, right in pairwise(widths):
        offsets.append(offsets[-1] + (left + right) / 2 + GAP)
    blocks: list[list[float]] = []  # sum of weights times places, sum of weights, number of nodes
    for (x, weight), offset in zip(wished, offsets, strict=True):
        blocks.append([weight * (x - offset), weight, 1])
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] > blocks[-1][0] / blocks[-1][1]:
            last = blocks.pop()
            blocks[-1] = [one + other for one, other in zip(blocks[-1], last, strict=True)]
    first = [total / weight for total, weight, count in blocks for _ in range(int(count))]
    return [x + offset for x, offset in zip(first, offsets, strict=True)]


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
    return [line for words in (inner, core, [f"and {name}" for name in others]) for line in broken(words, 18)]


def drawing() -> str:
    """Return the picture as SVG."""
    graph = arrows()
    rows, links = layers(graph)
    rows = untangled(rows, links)
    sizes = {}
    for room in graph:
        longest = max(map(len, (room, *lines_of(room))))
        sizes[room] = (max(24.0 + 1.05 * LETTER * longest, 84.0), HEIGHT + 12.0 * len(lines_of(room)))
    widths = {node: sizes[node][0] if node in sizes else 0.0 for row in rows for node in row}
    x_of = middles(rows, links, widths)
    heights = [max(sizes[room][1] for room in row if room in sizes) for row in rows]
    products = sorted(room for room in DOORS if room.startswith(PRODUCTS) and room not in APART)
    across = (WIDTH - GAP * (len(products) - 1) - 2 * MARGIN) / len(products)
    tall = max(HEIGHT + 12.0 * len(product_lines(product)) for product in products)
    trunk = sum(heights) + RISE * (len(rows) - 0.5) + 2 * GAP
    total = 2 * MARGIN + tall + RISE + trunk + 0.5 * RISE + HEIGHT
    boxes: dict[str, Box] = {}
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
        texts.append(_arrow([(x + 0.5 * across, MARGIN + tall, x + 0.5 * across, top)]))
    y -= 0.5 * RISE + GAP
    for row, height in zip(rows, heights, strict=True):
        y -= height + (0.0 if row is rows[0] else RISE)
        boxes |= {node: (x_of[node] - widths[node] / 2, y, widths[node], height) for node in row}
    ends = _ends(links, boxes)
    for room in sorted(graph):
        for to in sorted(graph[room]):
            passed = [node for row in reversed(rows) for node in row if node.startswith(f"{room}>{to}>")]
            texts.append(_arrow([ends[link] for link in pairwise([room, *passed, to])]))
    texts += [_box(*boxes[room], room, lines_of(room)) for room in sorted(graph)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {total:.0f}" '
        'font-family="sans-serif" text-anchor="middle">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#5b7083"/></marker></defs>'
        f'<rect width="{WIDTH:.0f}" height="{total:.0f}" fill="#ffffff"/>'
    )
    return "\n".join([head, *texts, "</svg>"]) + "\n"


def _ends(links: list[tuple[str, str]], boxes: dict[str, Box]) -> dict[tuple[str, str], tuple[float, ...]]:
    """Return the ends of each link, x and y of both, spread over the lower side of a box and the upper of the next."""

    def middle(node: str) -> tuple[float, str]:
        return boxes[node][0] + boxes[node][2] / 2, node

    ends = {}
    for user, used in links:
        x1, y1, width1, height = boxes[user]
        x2, y2, width2, _ = boxes[used]
        targets = sorted((b for a, b in links if a == user), key=middle)
        users = sorted((a for a, b in links if b == used), key=middle)
        ends[user, used] = (
            x1 + width1 * (targets.index(used) + 1) / (len(targets) + 1), y1 + height,
            x2 + width2 * (users.index(user) + 1) / (len(users) + 1), y2,
        )  # fmt: skip  # a line for each end
    return ends


def _arrow(links: list[tuple[float, ...]]) -> str:
    """Return an arrow along links: curves between levels, and straight down through the levels that it passes."""
    path = ""
    for x1, y1, x2, y2 in links:
        path += f"{'L' if path else 'M'}{x1:.0f} {y1:.0f} "
        middle = (y1 + y2) / 2
        path += f"C{x1:.0f} {middle:.0f} {x2:.0f} {middle:.0f} {x2:.0f} {y2:.0f} "
    return f'<path d="{path.strip()}" fill="none" stroke="#5b7083" marker-end="url(#tip)"/>'


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
