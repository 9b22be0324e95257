"""Links of long trees that differ in the zeros and signs of their numbers: recorded with the same operations.

The tape leaves out products with 0 and 1 and moves signs, so hinges about x, y and -z, or about any axes, give each
link operations of its own, and no loop is found. In long trees joints of one type have their axis as the z of their
links, and numbers in which such links differ are generic constants of the tape. That takes more operations for each
link, and one text for all of them; short trees stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from operator import eq

from eomgen.base.data import replace
from eomgen.mechanics.tree.inertia import RecordedInertia
from eomgen.mechanics.tree.joints import columns_of, motions_of, pose_of
from eomgen.mechanics.tree.links import ROOT, Link, Mount, Tree
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar

#: Least number of links, or of springs, of a kind for a loop: code of fewer is shorter without it.
FEWEST = 8


def is_irregular(tree: Tree, grouped: Tree) -> bool:
    """Return whether a long tree has many links whose numbers differ in zeros and signs without regularity. ``grouped``
    is the tree with grouped inertias. Nine of ten links equal to the link one to six places earlier are regular: loops
    over these need no change of axes. False for small trees."""
    if not tree.large:
        return False
    patterns: dict[tuple[object, ...], int] = {}
    order = [
        patterns.setdefault(_pattern(link, grouped_link.inertia, tree.mounts.get(link.name)), len(patterns))
        for link, grouped_link in zip(tree.links, grouped.links, strict=True)
        if link.motion is not None
    ]
    periods = range(1, min(6, len(order) - 1) + 1)
    return len(order) >= FEWEST and not any(
        sum(map(eq, order, order[period:])) >= 0.9 * (len(order) - period) for period in periods
    )


def _pattern(link: Link, grouped: RecordedInertia, mount: Mount | None) -> tuple[object, ...]:
    row = _numbers(link, grouped, mount)
    columns = [entry for column in link.columns for entry in (*column.angular, *column.linear)]
    return (*_kind(link, mount is not None), *map(_looked_at, [*row, *columns]), *_equal_moments(row))


def joints_along_z(scene: Scene) -> frozenset[str]:
    """Return the names of the joints whose axis becomes the z axis of the joint's links. These are all joints of a type
    with several axis directions, if there are at least ``FEWEST`` of the type."""
    kinds: dict[str, list[Joint]] = {}
    for joint in scene.joints:
        if joint.kind.turned_about or any(motion.axes for motion in joint.kind.chain):
            kinds.setdefault(joint.type, []).append(joint)
    return frozenset(
        joint.name
        for joints in kinds.values()
        if len(joints) >= FEWEST and len({_directions(joint) for joint in joints}) > 1
        for joint in joints
    )


def _directions(joint: Joint) -> tuple[object, ...]:
    return tuple(motion.axes for motion in motions_of(joint)[1])


def made_alike(tree: Tree, grouped: Tree) -> tuple[Tree, Tree]:
    """Return copies of a tree and of the tree with grouped inertias, in which alike links are recorded with equal
    operations. Links of a kind that differ in zeros and signs get generic constants. Inertias have been added and
    grouped before, since both look at numbers."""
    links, mounts, alike = list(tree.links), dict(tree.mounts), []
    inertias = [link.inertia for link in grouped.links]
    kinds: dict[tuple[object, ...], list[int]] = {}
    for index, link in enumerate(links):
        if link.motion is not None and link.coordinates.ratio.constant == 1.0:
            kinds.setdefault(_kind(link, link.name in mounts), []).append(index)
    for members in kinds.values():
        numbers = {index: _numbers(links[index], inertias[index], mounts.get(links[index].name)) for index in members}
        same = _members_with_pattern(numbers)
        # signs and zeros, at which the tape and the rule for equal moments look
        looks = {tuple(map(_looked_at, numbers[k])) + tuple(_equal_moments(numbers[k])) for k in same}
        if len(same) < FEWEST or len(looks) == 1:
            continue
        alike.append(tuple(same))
        for index, row in zip(same, generic_rows(tree.algebra, same, [numbers[k] for k in same], "link"), strict=True):
            links[index], inertias[index] = _with_numbers(tree.algebra, links[index], row)
            if links[index].name in mounts:
                mounts[links[index].name] = Mount(
                    index, _matrix(tree.algebra, row[-12:-3]), tree.algebra.vector(row[-3:])
                )
    made = replace(tree, links=tuple(links), mounts=mounts, alike=tuple(alike))
    moved = (replace(link, inertia=inertia) for link, inertia in zip(links, inertias, strict=True))
    return made, replace(made, links=tuple(moved))


def generic_rows(
    algebra: Algebra, members: Sequence[int], rows: Sequence[Sequence[Scalar]], label: str
) -> list[list[Scalar]]:
    """Return the rows of numbers with generic constants, which keep values but are not simplified, in differing
    columns. ``rows`` has the numbers of a member in each row; ``members`` and ``label`` identify the constants. Columns
    of equal numbers, and with entries that depend on parameters, are unchanged."""
    columns = []
    for index, column in enumerate(zip(*rows, strict=True)):
        if len({entry.ref for entry in column}) == 1 or any(entry.number is None for entry in column):
            columns.append(list(column))
            continue
        columns.append(
            [
                Scalar(algebra.tape, algebra.tape.generic(entry.number or 0.0, label, member, index))
                for member, entry in zip(members, column, strict=True)
            ]
        )
    return [list(row) for row in zip(*columns, strict=True)]


def _kind(link: Link, has_body: bool) -> tuple[object, ...]:
    """Return the properties in which links must agree to be members of one loop."""
    turn = None if link.turn is None else link.turn.place
    return (link.kind, link.joint.type, len(link.columns), turn, link.parent == ROOT, link.elastic is None, has_body)


#: Slices of a link's row of numbers: orientation, position, inertia, grouped inertia, pitch; rotors and mount follow.
_ORIENTATION, _POSITION, _INERTIA, _GROUPED = slice(0, 9), slice(9, 12), slice(12, 22), slice(22, 32)
_PITCH = _GROUPED.stop
_UPPER = [(i, j) for i in range(3) for j in range(i, 3)]


def _numbers(link: Link, grouped: RecordedInertia, mount: Mount | None) -> list[Scalar]:
    """Return the numbers of a link as a row: orientation and position at neutral coordinates, both inertias, pitch,
    rotor inertias, and the mount of the link's body, if any."""
    numbers = [*_flat(link.orientation), *link.neutral_position]
    for inertia in (link.inertia, grouped):
        numbers += [inertia.mass, *inertia.first, *(inertia.second[i][j] for i, j in _UPPER)]
    assert link.pitch is not None  # a link that a joint moves
    numbers += [link.pitch, *link.rotor_inertias]
    return numbers if mount is None else [*numbers, *_flat(mount.orientation), *mount.position]


def _flat(A: Matrix) -> list[Scalar]:
    return [entry for row in A for entry in row]


def _members_with_pattern(numbers: dict[int, list[Scalar]]) -> list[int]:
    """Return the keys of the rows with the common pattern of numbers. Left out are rows with a nonzero number in a
    column in which nearly all have zero, or a parameter in a column in which nearly all have none."""
    members = list(numbers)
    for _ in range(len(members)):
        rows = [numbers[index] for index in members]
        rare = [
            {index for index, count in enumerate(counts) if 0 < 50 * count < len(rows)}
            for counts in (
                [sum(not entry.is_zero for entry in column) for column in zip(*rows, strict=True)],
                [sum(entry.number is None for entry in column) for column in zip(*rows, strict=True)],
            )
        ]
        kept = [
            index
            for index, row in zip(members, rows, strict=True)
            if not any(not row[index].is_zero for index in rare[0]) and not any(row[p].number is None for p in rare[1])
        ]
        if len(kept) == len(members) or not kept:
            break
        members = kept
    return members


def _looked_at(entry: Scalar) -> float | None:
    number = entry.constant
    if number is None or number in (0.0, 1.0, -1.0):
        return number
    return 2.0 if number > 0.0 else -2.0


def _equal_moments(row: Sequence[Scalar]) -> Iterable[int]:
    """Yield, for each pair of second moments xx, yy and zz of an inertia, 1 if equal, -1 if opposite, else 0.

    These are three pairs (xx and yy, xx and zz, yy and zz) of the link's inertia, then three of the grouped inertia,
    both in the row of numbers (see ``_numbers``). A moment without a number, as by a parameter, gives 0, also if both
    are the same. ``inertia.wrench`` simplifies by equal and opposite moments.
    """
    for inertia in (_INERTIA, _GROUPED):
        second = dict(zip(_UPPER, row[inertia][4:], strict=True))
        for i, j in ((0, 1), (0, 2), (1, 2)):
            first, crossing = second[i, i].number, second[j, j].number
            alike = first is not None and crossing is not None and abs(first) == abs(crossing)
            yield (1 if first == crossing else -1) if alike else 0


def _with_numbers(algebra: Algebra, link: Link, row: Sequence[Scalar]) -> tuple[Link, RecordedInertia]:
    """Return a link, and the grouped inertia of the link, with the numbers of a row (see ``_numbers``) substituted."""
    motion = link.motion
    assert motion is not None  # a link that a joint moves
    orientation, position, pitch = _matrix(algebra, row[_ORIENTATION]), algebra.vector(row[_POSITION]), row[_PITCH]
    rotation, moved_to = pose_of(algebra, motion, pitch, orientation, position, link.coordinates.q)
    _, travel = pose_of(algebra, motion, pitch, orientation, algebra.zero_vector, link.coordinates.q)
    made = replace(
        link,
        rotation=rotation,
        orientation=orientation,
        neutral_position=position,
        travel=travel,
        position=moved_to,
        columns=columns_of(algebra, motion, pitch),
        inertia=replace(_inertia(algebra, row[_INERTIA]), added=link.inertia.added),
        rotor_inertias=tuple(row[_PITCH + 1 : _PITCH + 1 + len(link.columns)]),
        pitch=pitch,
    )
    return made, replace(_inertia(algebra, row[_GROUPED]), added=link.inertia.added)


def _inertia(algebra: Algebra, numbers: Sequence[Scalar]) -> RecordedInertia:
    upper = dict(zip(_UPPER, numbers[4:], strict=True))
    second = algebra.matrix([[upper[min(i, j), max(i, j)] for j in range(3)] for i in range(3)])
    return RecordedInertia(numbers[0], algebra.vector(numbers[1:4]), second)


def _matrix(algebra: Algebra, values: Sequence[Scalar]) -> Matrix:
    return algebra.matrix([values[:3], values[3:6], values[6:]])
