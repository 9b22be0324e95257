"""Recorders of time derivatives along a motion, and of the closed form's matrices.

Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.data import replace
from eomgen.mechanics.dynamics.elimination import solve_tree
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.mechanics.rates.closed_form import SystemMatrices, inverse_dynamics_closed, matrix_path
from eomgen.mechanics.rates.jets import MotionJets, accelerations, base_twist
from eomgen.mechanics.rates.recursion import Path, TreeDrive, cross_path, in_rotating_axes, inverse_dynamics_path
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.forward_dynamics import forward_blocks
from eomgen.mechanics.terms.recorders import recorder
from eomgen.symbolic.scalar import Scalar, minus, plus
from eomgen.symbolic.tape import ZERO, Ref
from eomgen.system.system import Block
from eomgen.system.terms import CLOSED_MATRICES, Term

_SUFFIXES = ("", "_dot", "_ddot")


def rate_blocks(derivation: Derivation, term: Term) -> list[Block]:
    """Return the blocks of a term, one per time derivative ``term.first`` to ``term.order``: ``tau``, ``tau_dot``,
    ``tau_ddot``, ``tau_3``..."""
    source, paths = derivatives_of(derivation, term.source, term.order)
    blocks = []
    for k in range(term.first, term.order + 1):
        name = source.name + (_SUFFIXES[k] if k < len(_SUFFIXES) else f"_{k}")
        meaning = source.description if k == 0 else f"time derivative {k} of it" if k > 1 else "its time derivative"
        blocks.append(Block(name, source.shape, tuple(path[k] for path in paths), meaning))
    return blocks


#: For each component the derivatives from order 0 on.
Paths = list[list[Ref]]


def derivatives_of(derivation: Derivation, source: str, order: int) -> tuple[Block, Paths]:
    """Return a term as a block, and for each component the time derivatives of orders 0 to ``order``. ``source`` is the
    name of the term. Of recursion and jets the way with fewer operations is taken."""
    if source in CLOSED_MATRICES or source.startswith("closed_"):
        return closed_block(derivation, source, order)
    (block,) = recorder(source)(derivation)
    if source == "forward_dynamics":
        return block, forward_rates(derivation, order)
    ways = []
    if source == "inverse_dynamics" and derivation.tree.rigid:
        ways.append(inverse_dynamics_rates(derivation, order))
    if not ways or any(derivation.loads.wrenches):  # jets of positions serve loads and inertia
        ways.append(_by_jets(derivation, block, order))
    return block, min(ways, key=lambda paths: derivation.tape.counts([ref for path in paths for ref in path]).weight)


def _by_jets(derivation: Derivation, block: Block, order: int, along: Paths | None = None) -> Paths:
    with derivation.tape.block(f"time derivatives of {block.description}"):
        return motion_jets(derivation).of(block.refs, order, along)


def closed_block(derivation: Derivation, source: str, order: int) -> tuple[Block, Paths]:
    """Return a quantity of the closed form as a block, and for each component the time derivatives up to ``order``.
    ``source`` is a name of ``matrix_path``, or ``closed_inverse_dynamics``."""
    system = SystemMatrices(derivation.tree, velocity_paths(derivation, order))
    with derivation.tape.block(f"closed form of {source}"):
        if source == "closed_inverse_dynamics":
            omega, velocity, fall = base_motion(derivation, order)
            loads, efforts = _applied_paths(derivation, order, None)
            twist = list(zip(omega, velocity, strict=True))
            tau = inverse_dynamics_closed(system, twist, fall, loads, order)
            values = [[x - path[k] for x, path in zip(row, efforts, strict=True)] for k, row in enumerate(tau)]
            empty = Block("tau", (derivation.tree.nv,), (), "generalized force that the motion a needs")
        else:
            name, shape, meaning, values = matrix_path(system, source.removeprefix("closed_"), order)
            empty = Block(name, shape, (), meaning)
    paths = [[row[entry].ref for row in values] for entry in range(len(values[0]))]
    return replace(empty, refs=tuple(path[0] for path in paths)), paths


def forward_rates(derivation: Derivation, order: int) -> Paths:
    """Return vdot and the time derivatives of vdot along the motion of the forced system, (nv, order + 1).

    Each derivative of tau is linear in the highest derivative of v, with the factor M, and zero along this motion: so
    every further derivative takes one further substitution in the factors of M. For trees too deep for M: jets of vdot
    along the flow.
    """
    tree = derivation.tree
    if derivation.tree.deep and tree.rigid and not tree.following:
        (block,) = forward_blocks(derivation)
        return motion_jets(derivation).along_flow(block.refs, order)
    M = derivation.mass_rows
    (tau,) = derivation.inverse_dynamics()
    along: Paths = [[] for _ in range(tree.nv)]
    for k in range(order + 1):
        paths = [[*path, ZERO] for path in along]
        rest = inverse_dynamics_rates(derivation, k, paths) if tree.rigid else _by_jets(derivation, tau, k, paths)
        right = [-Scalar(derivation.tape, path[k]) for path in rest]
        with derivation.tape.block("substitution in the factors of the mass matrix"):
            for path, value in zip(along, solve_tree(M, right, tree.dof_parents()), strict=True):
                path.append(value.ref)
    return along


def motion_jets(derivation: Derivation) -> MotionJets:
    """Return the jets of a scene along a motion."""
    scene = derivation.scene
    return MotionJets(derivation.tree, derivation.kinematics.carrier, len(scene.inputs), derivation.internal)


def inverse_dynamics_rates(derivation: Derivation, order: int, along: Sequence[Sequence[Ref]] | None = None) -> Paths:
    """Return tau and the time derivatives of tau, (nv, order + 1): inertia and gravity by recursion, applied loads by
    jets. ``along`` holds a and derivatives for each velocity component, unless these are inputs of the tape."""
    tree = derivation.grouped
    omega, acceleration = base_paths(derivation, order)
    loads, efforts = _applied_paths(derivation, order, along)
    drive = TreeDrive(velocity_paths(derivation, order, along), omega, acceleration)
    tau = inverse_dynamics_path(tree, drive, loads, order)
    return [[(tau[k][row] - efforts[row][k]).ref for k in range(order + 1)] for row in range(tree.nv)]


def velocity_paths(
    derivation: Derivation, order: int, along: Sequence[Sequence[Ref]] | None = None
) -> list[list[Scalar]]:
    """Return for each velocity component v and the time derivatives up to order + 1. ``along`` holds a and derivatives
    for each component; by default these are inputs of the tape."""
    tape = derivation.tape
    paths = accelerations(tape, derivation.tree.nv, order) if along is None else along
    return [[Scalar(tape, ref) for ref in (tape.input("v", k), *path)] for k, path in enumerate(paths)]


def base_paths(derivation: Derivation, order: int) -> tuple[Path, Path]:
    """Return, in root axes with time derivatives, the angular velocity of the root frame and the acceleration of the
    root's origin minus gravity. The angular velocity goes to ``order`` + 1, the acceleration to ``order``."""
    omega, velocity, fall = base_motion(derivation, order)
    acceleration = [plus(velocity[k + 1], cross_path(omega, velocity, k)) for k in range(order + 1)]
    return omega, [minus(x, y) for x, y in zip(acceleration, fall, strict=True)]


def base_motion(derivation: Derivation, order: int) -> tuple[Path, Path, Path]:
    """Return, in root axes with time derivatives, omega and velocity of the root frame up to order + 1, and gravity up
    to order. All but gravity are 0 for a base at rest."""
    base, zero = derivation.base, derivation.algebra.zero_vector
    omega, velocity = [zero] * (order + 2), [zero] * (order + 2)
    if base.moving:
        parts = [
            [Scalar(derivation.tape, ref) for ref in path] for path in base_twist(derivation.tape, base, order + 1)
        ]
        velocity = [(parts[3][k], parts[4][k], parts[5][k]) for k in range(order + 2)]
        if base.turning:
            omega = [(parts[0][k], parts[1][k], parts[2][k]) for k in range(order + 2)]
    return omega, velocity, in_rotating_axes([derivation.motion.gravity, *([zero] * order)], omega)


def _applied_paths(
    derivation: Derivation, order: int, along: Sequence[Sequence[Ref]] | None
) -> tuple[list[list[Wrench] | None], list[list[Scalar]]]:
    """Return the applied wrenches by link (or None), in link axes, and the efforts by velocity component, each with
    time derivatives up to ``order``. ``along`` holds a and derivatives, unless these are inputs of the tape."""
    tape = derivation.tape
    flat = [value for load in derivation.loads.wrenches if load is not None for part in load for value in part]
    with tape.block("time derivatives of applied forces"):
        derivatives = motion_jets(derivation).of(
            [value.ref for value in (*flat, *derivation.loads.efforts)], order, along
        )
    paths = [[Scalar(tape, ref) for ref in path] for path in derivatives]
    loads: list[list[Wrench] | None] = []
    start = 0
    for load in derivation.loads.wrenches:
        if load is None:
            loads.append(None)
            continue
        m, f = paths[start : start + 3], paths[start + 3 : start + 6]
        loads.append([((m[0][k], m[1][k], m[2][k]), (f[0][k], f[1][k], f[2][k])) for k in range(order + 1)])
        start += 6
    return loads, paths[start:]
