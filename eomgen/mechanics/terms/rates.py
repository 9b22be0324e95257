"""Terms that are time derivatives along a motion, and the matrices of the closed form: names, inputs, and what they are made of.

A name ending in ``_rates`` gives first and second derivatives, in ``_rates_1`` the first only. ``rates``, of inverse dynamics to
any order up to 8, and ``forward_rates`` start with the quantity itself. Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from eomgen.mechanics.terms.rate_sources import derivatives_of
from eomgen.system.system import Block
from eomgen.system.terms import CLOSED_MATRICES, HIGHEST_RATE

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


#: Matrices of the closed form: what they are, and how many derivatives less than their own order they need of v.
_CLOSED: dict[str, tuple[str, int]] = {
    "system_jacobian": ("J, twists of all links against the base per unit of v", 1),
    "adjoints": ("A, adjoint transforms from every link to every link that it carries", 1),
    "joint_brackets": ("a, brackets ad of the joints' own twists, link by link", 0),
    "link_brackets": ("b, brackets ad of the links' twists against the base, link by link", 0),
    "coriolis": ("C with C v = h, J^T (M J' - b^T M J)", 0),
    "coriolis_skew": ("C with C v = h for which M' - 2 C is skew", 0),
}
_SECOND_WAY = "by the closed matrix form: a second derivation, for checks"


def _of_matrix(name: str, first: int, order: int) -> RateTerm:
    what, less = _CLOSED[name]
    needed = order - less  # derivatives of v
    inputs: Inputs = ("p", "q", "v") if needed >= 0 else ("p", "q")
    text = {0: what, 1: f"first time derivative of {what}", 2: f"first and second time derivative of {what}"}[order]
    return RateTerm(name, first, order, needed - 1, inputs, text)


def _all() -> dict[str, RateTerm]:
    terms = {"rates" if order == 2 else f"rates_{order}": _of_inverse_dynamics(order) for order in range(1, HIGHEST_RATE + 1)}
    blocks: list[tuple[str, str, int, Inputs]] = [
        ("mass", "M", 2, ("p", "q", "v")), ("coupling", "h", 1, ("p", "q", "v")), ("force", "Q", 1, _STATE),
        ("base_motion", "b", 1, ("p", "q", "v", "base")),
    ]  # fmt: skip
    for source, symbol, less, inputs in blocks:
        for order, suffix in ((1, "_1"), (2, "")):
            terms[f"{source}_rates{suffix}"] = _of_block(source, symbol, order, order - less, inputs)
    tau, M = _of_inverse_dynamics(2), terms["mass_rates"]
    terms["rates_closed"] = replace(tau, source="closed_inverse_dynamics", description=f"{tau.description}, {_SECOND_WAY}")
    terms["mass_rates_closed"] = replace(M, source="closed_mass", description=f"{M.description}, {_SECOND_WAY}")
    for name in CLOSED_MATRICES:
        for first, order, suffix in ((0, 0, ""), (1, 1, "_rates_1"), (1, 2, "_rates")):
            terms[f"{name}{suffix}"] = _of_matrix(name, first, order)
    for order, suffix in ((1, "_1"), (2, "")):
        what = "vdot and its time derivative" if order == 1 else "vdot and its first and second time derivative"
        terms[f"forward_rates{suffix}"] = RateTerm("forward_dynamics", 0, order, -1, _STATE, f"{what} along the free motion")
    return terms


#: All terms of this kind by name.
RATE_TERMS: dict[str, RateTerm] = _all()

#: Terms of the closed form, which knows rigid bodies only.
OF_RIGID_TREES = frozenset(
    name for name, term in RATE_TERMS.items() if term.source in CLOSED_MATRICES or term.source.startswith("closed_")
)

_SUFFIXES = ("", "_dot", "_ddot")


def rate_blocks(derivation: Derivation, term: RateTerm) -> list[Block]:
    """Return the outputs of a term, derivative by derivative: ``tau``, ``tau_dot``, ``tau_ddot``, ``tau_3``..."""
    source, paths = derivatives_of(derivation, term.source, term.order)
    blocks = []
    for k in range(term.first, term.order + 1):
        name = source.name + (_SUFFIXES[k] if k < len(_SUFFIXES) else f"_{k}")
        what = source.description if k == 0 else f"time derivative {k} of it" if k > 1 else "its time derivative"
        blocks.append(Block(name, source.shape, tuple(path[k] for path in paths), what))
    return blocks
