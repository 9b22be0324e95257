"""The tree of joints: every body carried once, all of it hanging from the base, and an order with parents first."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from eomgen.scene.names import key_of, listed, nearest, shown
from eomgen.scene.report import Report
from eomgen.scene.scene import BASE


class Link(NamedTuple):
    """A joint as the tree sees it."""

    name: str
    parent: str
    child: str


def ordered(
    links: Sequence[Link], bodies: Collection[str], refused: Collection[str], complete: bool, report: Report
) -> list[Link]:
    """Return the joints with parents before children, in the user's order otherwise; report what breaks the tree.

    Parameters
    ----------
    links : sequence of Link
        In the user's order.
    bodies : collection of str
        Declared bodies.
    refused : collection of str
        Bodies whose declarations are broken: they exist, but nothing is known of them.
    complete : bool
        Whether every joint and body could be read; where not, missing joints are not reported.
    """
    known = [*bodies, *refused]
    carrier: dict[str, Link] = {}
    for link in links:
        key = key_of("joints", link.name)
        if link.parent != BASE and link.parent not in known:
            report.add(f"{key}.parent", f"there is no body {shown(link.parent)}", nearest(link.parent, [BASE, *known]))
        if link.child == BASE:
            hint = "the base as parent, or a free joint for a floating body"
            report.add(f"{key}.child", "the base cannot be a child: it carries the tree", hint)
        elif link.child not in known:
            report.add(f"{key}.child", f"there is no body {shown(link.child)}", nearest(link.child, known))
        elif link.child in carrier:
            what = f"the body {link.child} is already carried by the joint {carrier[link.child].name}"
            report.add(f"{key}.child", what, "one joint for each body")
        elif link.parent == link.child:
            report.add(f"{key}.parent", f"the joint connects the body {link.child} to itself", "another parent")
        carrier.setdefault(link.child, link)
    order = _parents_first(links, carrier, known)
    if complete:
        _report_lost(order, carrier, bodies, report)
    return order


def _parents_first(links: Sequence[Link], carrier: Mapping[str, Link], known: Collection[str]) -> list[Link]:
    children: dict[str, list[int]] = {}
    for number, link in enumerate(links):
        if carrier.get(link.child) is link and link.child in known and link.child not in (BASE, link.parent):
            children.setdefault(link.parent, []).append(number)
    ready = list(children.get(BASE, []))
    heapq.heapify(ready)
    order: list[Link] = []
    while ready:
        link = links[heapq.heappop(ready)]
        order.append(link)
        for number in children.get(link.child, []):
            heapq.heappush(ready, number)
    return order


def _report_lost(order: Sequence[Link], carrier: Mapping[str, Link], bodies: Collection[str], report: Report) -> None:
    """Report bodies without a joint, cycles, and what hangs from either."""
    reached = {link.child for link in order}
    lost = [body for body in bodies if body not in reached]
    heads: dict[str, list[str]] = {}
    cycles: dict[str, list[str]] = {}
    for body in lost:
        path = [body]
        while path[-1] in carrier and carrier[path[-1]].parent not in path:
            path.append(carrier[path[-1]].parent)
        if path[-1] in carrier:
            start = carrier[path[-1]].parent
            cycle = path[path.index(start) :]
            cycles.setdefault(min(cycle), cycle[::-1])
        else:
            heads.setdefault(path[-1], []).append(body)
    for cycle in cycles.values():
        if len(cycle) > 1:
            what = f"the joints carry the bodies {listed(cycle)} in a circle"
            report.add(f"joints.{carrier[cycle[0]].name}", what, f"{BASE} as the parent of one of them")
    for head, bodies_there in heads.items():
        if head in bodies:
            others = [body for body in bodies_there if body != head]
            rest = f", nor what hangs from it: {listed(others)}" if others else ""
            report.add(f"bodies.{head}", f"no joint carries the body {head}{rest}", f'a joint with child = "{head}"')
