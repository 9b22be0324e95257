"""Terms that are time derivatives along a motion: of inverse dynamics and of the separated blocks, to any order up to 8.

A name ending in ``_rates`` gives first and second derivatives, in ``_rates_1`` the first only; ``rates`` is that of inverse
dynamics and starts with tau itself. Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257, by jets on the tape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from eomgen.mechanics.motion_jets import MotionJets, accelerations, base_twist
from eomgen.mechanics.paths import Path, cross_path, seen_from
from eomgen.mechanics.rate_recursion import Drive, inverse_dynamics_path
from eomgen.mechanics.terms import Wrench
from eomgen.scene.scene import HIGHEST_RATE
from eomgen.symbolic.scalar import Scalar, minus, plus, scaled
from eomgen.symbolic.tape import Ref
from eomgen.system import Block

if TYPE_CHECKING:
    from eomgen.mechanics.derivation import Derivation

Inputs = tuple[str, ...]
_STATE: Inputs = ("p", "t", "q", "v", "z", "u", "base")


@dataclass(frozen=True)
class RateTerm:
    """One term: derivatives of ``source`` from order ``first`` to ``order``; ``accelerations``: orders of a that it needs."""

    source: str
    first: int
    order: int
    accelerations: int
    inputs: Inputs
    description: str

    @property
    def blocks(self) -> Inputs:
        """Input blocks that the term may depend on."""
        higher = ("a", "j", "s")[: self.accelerations + 1]
        found = [*self.inputs, *higher, *(("a_higher",) if self.accelerations > 2 else ())]
        if "u" in self.inputs:
            found += [("u_dot", "u_ddot")[k] for k in range(min(self.order, 2))]
            found += ["u_higher"] if self.order > 2 else []
        return (*found, "base_rates") if "base" in self.inputs else tuple(found)


def _of_inverse_dynamics(order: int) -> RateTerm:
    what = {1: "tau and its time derivative", 2: "tau and its first and second time derivative"}
    text = what.get(order, f"tau and its time derivatives up to order {order}")
    return RateTerm("inverse_dynamics", 0, order, order, _STATE, f"{text}, tau = M a + h + b - Q along the motion")


def _of_block(source: str, symbol: str, order: int, accelerations: int, inputs: Inputs) -> RateTerm:
    text = "first time derivative" if order == 1 else "first and second time derivative"
    return RateTerm(source, 1, order, accelerations, inputs, f"{text} of {symbol} along the motion")


def _all() -> dict[str, RateTerm]:
    terms = {"rates" if order == 2 else f"rates_{order}": _of_inverse_dynamics(order) for order in range(1, HIGHEST_RATE + 1)}
    blocks: list[tuple[str, str, int, Inputs]] = [
        ("mass", "M", 2, ("p", "q", "v")), ("coupling", "h", 1, ("p", "q", "v")), ("force", "Q", 1, _STATE),
        ("base_motion", "b", 1, ("p", "q", "v", "base")),
    ]  # fmt: skip
    for source, symbol, less, inputs in blocks:
        for order, suffix in ((1, "_1"), (2, "")):
            terms[f"{source}_rates{suffix}"] = _of_block(source, symbol, order, order - less, inputs)
    return terms


#: All terms of this kind by name.
RATE_TERMS: dict[str, RateTerm] = _all()

_SUFFIXES = ("", "_dot", "_ddot")


def rate_blocks(derivation: Derivation, term: RateTerm) -> list[Block]:
    """Return the outputs of a term, derivative by derivative: ``tau``, ``tau_dot``, ``tau_ddot``, ``tau_3``..."""
    source: Callable[[], Sequence[Block]] = getattr(derivation, term.source)
    (block,) = source()
    derivatives = _cheapest(derivation, block, term)
    blocks = []
    for k in range(term.first, term.order + 1):
        name = block.name + (_SUFFIXES[k] if k < len(_SUFFIXES) else f"_{k}")
        what = block.description if k == 0 else f"time derivative {k} of it" if k > 1 else "its time derivative"
        blocks.append(Block(name, block.shape, tuple(path[k] for path in derivatives), what))
    return blocks


def _cheapest(derivation: Derivation, block: Block, term: RateTerm) -> list[list[Ref]]:
    """Return the derivatives of a block's components: by recursion where there is one, by jets where those need less."""
    ways = []
    if term.source == "inverse_dynamics" and not derivation.tree.elastic:
        ways.append(inverse_dynamics_rates(derivation, term.order))
    if not ways or any(load is not None for load in derivation.loads.wrenches):  # jets of positions serve loads and inertia
        with derivation.tape.block(f"time derivatives of {block.description}"):
            ways.append(motion_jets(derivation).of(block.refs, term.order))
    return min(ways, key=lambda paths: derivation.tape.counts([ref for path in paths for ref in path]).weight)


def motion_jets(derivation: Derivation) -> MotionJets:
    scene = derivation.scene
    return MotionJets(derivation.tree, derivation.kinematics.carrier, len(scene.inputs), derivation.internal)


def inverse_dynamics_rates(derivation: Derivation, order: int) -> list[list[Ref]]:
    """Return for each component of tau its derivatives: inertia and gravity by recursion, what is applied by jets."""
    tape, tree = derivation.tape, derivation.grouped
    velocities = [
        [Scalar(tape, ref) for ref in (tape.input("v", k), *path)]
        for k, path in enumerate(accelerations(tape, tree.nv, order))
    ]
    omega, acceleration = base_paths(derivation, order)
    loads, efforts = _applied(derivation, order)
    tau = inverse_dynamics_path(tree, Drive(velocities, omega, acceleration), loads, order)
    return [[(tau[k][row] - efforts[row][k]).ref for k in range(order + 1)] for row in range(tree.nv)]


def base_paths(derivation: Derivation, order: int) -> tuple[Path, Path]:
    """Return angular velocity of what carries the tree, and acceleration of its origin less gravity, as paths in its axes."""
    base, algebra = derivation.base, derivation.algebra
    zero, gravity = algebra.zero_vector, derivation.motion.gravity
    if not base.moving:
        return [zero] * (order + 2), [scaled(-1.0, gravity), *([zero] * order)]
    components = [[Scalar(derivation.tape, ref) for ref in path] for path in base_twist(derivation.tape, order + 1)]
    omega, velocity = ([(x[k], y[k], z[k]) for k in range(order + 2)] for x, y, z in (components[:3], components[3:]))
    if not base.turning:
        omega = [zero] * (order + 2)
    weight = seen_from([gravity, *([zero] * order)], omega)
    acceleration = [plus(velocity[k + 1], cross_path(omega, velocity, k)) for k in range(order + 1)]
    return omega, [minus(x, y) for x, y in zip(acceleration, weight, strict=True)]


def _applied(derivation: Derivation, order: int) -> tuple[list[list[Wrench] | None], list[list[Scalar]]]:
    """Return the paths of applied wrenches by link, in link axes, and of efforts by velocity component."""
    tape = derivation.tape
    flat = [value for load in derivation.loads.wrenches if load is not None for part in load for value in part]
    with tape.block("time derivatives of applied forces"):
        found = motion_jets(derivation).of([value.ref for value in (*flat, *derivation.loads.efforts)], order)
    paths = [[Scalar(tape, ref) for ref in path] for path in found]
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
