"""Terms that are time derivatives along a motion: of inverse dynamics and of the separated blocks, to any order up to 8.

A name ending in ``_rates`` gives first and second derivatives, in ``_rates_1`` the first only; ``rates`` is that of inverse
dynamics and starts with tau itself. Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257, by jets on the tape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from eomgen.mechanics.motion_jets import MotionJets
from eomgen.scene.scene import HIGHEST_RATE
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
    derivatives = _derivatives(derivation, block, term.order)
    blocks = []
    for k in range(term.first, term.order + 1):
        name = block.name + (_SUFFIXES[k] if k < len(_SUFFIXES) else f"_{k}")
        what = block.description if k == 0 else f"time derivative {k} of it" if k > 1 else "its time derivative"
        blocks.append(Block(name, block.shape, tuple(path[k] for path in derivatives), what))
    return blocks


def _derivatives(derivation: Derivation, block: Block, order: int) -> list[list[Ref]]:
    scene = derivation.scene
    motion = MotionJets(derivation.tree, derivation.kinematics.carrier, len(scene.inputs), derivation.internal)
    with derivation.tape.block(f"time derivatives of {block.description}"):
        return motion.of(block.refs, order)
