"""Seeds of tangents and jets for the inputs of a configuration, a product of Lie groups.

Left-trivialised (body-frame) throughout: SO(3) q' = 1/2 q (0, omega); SE(3) besides x' = R(q) v. So a unit quaternion
is never differentiated as if its four numbers were free.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from eomgen.symbolic.calculus.jets import Jet, JetAlgebra, coefficient, jets
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape


def tangent_seeds(tape: Tape, group: str, q: Sequence[Ref], first: int = 0) -> dict[Ref | InputSymbol, Tangent]:
    """Return the seeds of one factor of the configuration, for left-trivialised (body-frame) directions.

    Parameters
    ----------
    group : {"R", "SO3", "SE3"}
        ``R``: as many directions as numbers. ``SO3``: unit quaternion (w, x, y, z), dq = 1/2 q (0, dtheta).
        ``SE3``: quaternion, then position; directions angular first, dx = R(q) dx_body.
    q : sequence of input references
    first : int
        Number of the first direction.

    Raises
    ------
    ValueError
        For an unknown group, or a number of references that does not fit the group.
    """
    sizes = {"R": len(q), "SO3": 4, "SE3": 7}
    if len(q) != sizes.get(group, -1):
        raise ValueError(f"no tangent for group {group!r} with {len(q)} numbers; known: R (any), SO3 (4), SE3 (7)")
    if group == "R":
        return {ref: {first + k: ONE} for k, ref in enumerate(q)}
    half = tape.constant(0.5)
    w, x, y, z = (tape.mul(half, ref) for ref in q[:4])
    rows = [(-x, -y, -z), (w, -z, y), (z, w, -x), (-y, x, w)]
    seeds: dict[Ref | InputSymbol, Tangent] = {ref: _tangent(first, row) for ref, row in zip(q[:4], rows, strict=True)}
    if group == "SE3":
        for ref, row in zip(q[4:], rotation(tape, q[:4]), strict=True):
            seeds[ref] = _tangent(first + 3, row)
    return seeds


def configuration_seeds(
    tape: Tape, factors: Iterable[tuple[str, int, int, int]], block: str = "q"
) -> dict[Ref | InputSymbol, Tangent]:
    """Return the seeds of a configuration for ``forward_partials``: {input reference: {velocity component:
    derivative}}. ``factors`` are (group, q_start, q_size, v_start), groups as in ``tangent_seeds``; ``block`` is the
    input block of q."""
    seeds: dict[Ref | InputSymbol, Tangent] = {}
    for group, q_start, q_size, v_start in factors:
        seeds |= tangent_seeds(tape, group, [tape.input(block, q_start + k) for k in range(q_size)], v_start)
    return seeds


def quaternion_jet(tape: Tape, q: Sequence[Ref], omega: Sequence[Jet], order: int) -> list[list[Ref]]:
    """Return the jets of a unit quaternion (w, x, y, z) from jets of the body angular velocity: q' = 1/2 q (0, omega).

    ``omega`` holds three jets, needed up to order - 1; coefficients beyond a list are zero.
    """
    jet = [list(q)]
    for k in range(order):
        total = [ZERO] * 4
        for i, (w, x, y, z) in enumerate(jet):
            a, b, c = (coefficient(component, k - i) for component in omega)
            rate = (
                ((-x, a), (-y, b), (-z, c)),
                ((w, a), (y, c), (-z, b)),
                ((w, b), (z, a), (-x, c)),
                ((w, c), (x, b), (-y, a)),
            )
            for row, pairs in enumerate(rate):
                for left, right in pairs:
                    total[row] = tape.add(total[row], tape.mul(left, right))
        half = tape.constant(0.5 / (k + 1))
        jet.append([tape.mul(half, ref) for ref in total])
    return [list(component) for component in zip(*jet, strict=True)]


def pose_jet(tape: Tape, pose: Sequence[Ref], twist: Sequence[Jet], order: int) -> list[list[Ref]]:
    """Return the jets of a pose, seven components (quaternion, position), each with coefficients 0 to ``order``.
    ``pose`` are the references at order 0, ``twist`` the six jets of the body twist (omega, v = R^T x')."""
    turning = quaternion_jet(tape, pose[:4], twist[:3], order)
    entries = [ref for row in rotation(tape, pose[:4]) for ref in row]
    matrix = jets(tape, entries, dict(zip(pose[:4], turning, strict=True)), order)
    velocity = [[coefficient(component, k) for k in range(order + 1)] for component in twist[3:]]
    algebra = JetAlgebra(tape)
    moving: list[list[Ref]] = []
    for row, start in enumerate(pose[4:]):
        rate = [ZERO] * order
        for column in range(3):
            product = algebra.multiply(matrix[3 * row + column][:order], velocity[column][:order])
            rate = algebra.add(rate, product)
        moving.append(algebra.integrate(start, rate))
    return turning + moving


def configuration_jets(
    tape: Tape, factors: Iterable[tuple[str, int, int, int]], velocity: Sequence[Jet], order: int, block: str = "q"
) -> dict[Ref | InputSymbol, Jet]:
    """Return the jets of a whole configuration by input reference, as input of ``jets``, given jets of the body
    velocity. ``factors`` are (group, q_start, q_size, v_start), groups as in ``tangent_seeds``; ``velocity`` holds one
    jet per velocity component, needed up to order - 1. Raises ValueError for an unknown group."""
    result: dict[Ref | InputSymbol, Jet] = {}
    for group, q_start, q_size, v_start in factors:
        q = [tape.input(block, q_start + k) for k in range(q_size)]
        if group == "SO3":
            component_jets = quaternion_jet(tape, q, velocity[v_start : v_start + 3], order)
        elif group == "SE3":
            component_jets = pose_jet(tape, q, velocity[v_start : v_start + 6], order)
        elif group == "R":
            rates = [[coefficient(velocity[v_start + k], i) for i in range(order)] for k in range(q_size)]
            component_jets = [JetAlgebra(tape).integrate(start, rate) for start, rate in zip(q, rates, strict=True)]
        else:
            raise ValueError(f"no jet for group {group!r}; known: R, SO3, SE3")
        result |= dict(zip(q, component_jets, strict=True))
    return result


def rotation(tape: Tape, quaternion: Sequence[Ref]) -> list[list[Ref]]:
    """Return the rows of the rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    two = tape.constant(2.0)
    double = [tape.mul(two, ref) for ref in (x, y, z)]
    xx, yy, zz = (tape.mul(d, ref) for d, ref in zip(double, (x, y, z), strict=True))
    xy, xz, yz = tape.mul(double[0], y), tape.mul(double[0], z), tape.mul(double[1], z)
    wx, wy, wz = (tape.mul(d, w) for d in double)
    return [
        [tape.sub(ONE, tape.add(yy, zz)), tape.sub(xy, wz), tape.add(xz, wy)],
        [tape.add(xy, wz), tape.sub(ONE, tape.add(xx, zz)), tape.sub(yz, wx)],
        [tape.sub(xz, wy), tape.add(yz, wx), tape.sub(ONE, tape.add(xx, yy))],
    ]


def _tangent(first: int, row: Iterable[Ref]) -> Tangent:
    return {first + k: ref for k, ref in enumerate(row) if abs(ref) != ZERO}
