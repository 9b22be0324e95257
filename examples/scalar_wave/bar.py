"""A front end of eomgen: an elastic bar of equal linear elements, its waves the scalar wave equation.

    m u_tt = EA u_xx on (0, L),  u(0) = 0,  u(L) = 0 or EA u_x(L) = traction,   speed c = sqrt(EA/m)

An element of length s between nodes i and i + 1 has the stiffness EA/s [1 -1; -1 1] and the mass m s/6 [2 1; 1 2]
(consistent) or m s/2 [1 0; 0 1] (lumped).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from eomgen.errors import DescriptionError, Problem
from eomgen.lie.product import Factor
from eomgen.pipeline.front_end import FrontEnd
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ZERO, Tape
from eomgen.system.description import Coordinates, Description, Simulation
from eomgen.system.signals import Parameter
from eomgen.system.system import Block, Facts, Function, Quantity, System
from eomgen.system.terms import TERMS

#: Mass of an element in shares of m s: diagonal, off the diagonal.
MASSES: dict[str, tuple[float, float]] = {"consistent": (1.0 / 3.0, 1.0 / 6.0), "lumped": (0.5, 0.0)}
PARAMETERS = (
    Parameter("axial_stiffness", 1.0, True, "N", "EA"),
    Parameter("mass_per_length", 1.0, True, "kg/m", "m"),
    Parameter("length", 1.0, True, "m", "L"),
)
TRACTION = Parameter("traction", 1.0, True, "N", "force on the free end")
#: Nonzeros of a matrix by row and column, in the order of the rows.
Entries = dict[tuple[int, int], Scalar]


@dataclass(frozen=True)
class Bar:
    """A bar of equal elements, held at x = 0, at rest at first.

    Attributes
    ----------
    displacements : of the nodes that move, from x = L/elements on, m: those within the bar, and the free end's
    mass : of the elements, ``consistent`` or ``lumped``
    free_end : whether the end x = L is free and the traction pulls it, from t = 0 on
    """

    name: str
    displacements: tuple[float, ...]
    mass: str = "consistent"
    free_end: bool = False

    def __post_init__(self) -> None:
        problems = []
        if self.mass not in MASSES:
            problems.append(
                Problem(f"{self.name}.mass", f"{self.mass!r} is no mass of an element", " or ".join(MASSES))
            )
        if len(self.displacements) < 2:
            what = f"{len(self.displacements)} nodes that move are too few"
            problems.append(Problem(f"{self.name}.displacements", what, "at least 2"))
        if not all(math.isfinite(u) for u in self.displacements):
            problems.append(Problem(f"{self.name}.displacements", "all of them must be finite numbers"))
        if problems:
            raise DescriptionError(problems)

    @property
    def content(self) -> bytes:
        return repr(self).encode()

    @property
    def front_end(self) -> FrontEnd:
        return BARS

    @property
    def elements(self) -> int:
        return len(self.displacements) + (not self.free_end)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*PARAMETERS, TRACTION) if self.free_end else PARAMETERS


def describe(bar: Bar) -> Description:
    return Description(
        bar.name,
        f"elastic bar of {bar.elements} elements with {bar.mass} mass",
        parameters=bar.parameters,
        coordinates=tuple(Coordinates(name, ("m",)) for name in _nodes(bar)),
        simulation=Simulation(step=1.0 / bar.elements, duration=1.0),
    )


def derive(bar: Bar, terms: Sequence[str] | None) -> System:
    """Return the bar's System. Implicit steps take the nonzeros of its matrices from the term ``iteration``; whole
    matrices are recorded where they are asked for by name."""
    tape, n, nodes = Tape(), len(bar.displacements), _nodes(bar)
    algebra = Algebra(tape)
    EA, m, L, *pull = algebra.block("p", len(bar.parameters))
    q, v, a = (algebra.block(name, n) for name in "qva")
    with tape.block("stiffness and mass of an element"):
        stiffness = EA * float(bar.elements) / L
        diagonal, beside = (share * (m * L / float(bar.elements)) for share in MASSES[bar.mass])
    K, M = (_assembled(bar, *element) for element in ((stiffness, -stiffness), (diagonal, beside)))
    with tape.block("axial forces of the elements, and what they leave at the nodes"):
        ends = (algebra.zero, *q, *(() if bar.free_end else (algebra.zero,)))
        strains = [after - before for before, after in pairwise(ends)]
        axial = [*(stiffness * strain for strain in strains), *pull]
        forces = [after - before for before, after in pairwise(axial)]
    with tape.block("M a"):
        inertia = _product(M, a)
    with tape.block("kinetic and potential energy"):
        kinetic = _sum(algebra, [x * y for x, y in zip(v, _product(M, v), strict=True)])
        elastic = _sum(algebra, [strain * strain for strain in strains])
        load = pull[0] * q[-1] if pull else algebra.zero
    with tape.block("M^-1 of the forces, by elimination along the bar"):
        accelerations = _solved(M, forces)
    residual = [x - force for x, force in zip(inertia, forces, strict=True)]
    energy = (0.5 * kinetic, 0.5 * stiffness * elastic - load, algebra.zero, algebra.zero)
    blocks: dict[str, tuple[Block, ...]] = {
        "residual": (_block("r", residual),),
        "iteration": (_block("K", K.values()), _block("M", M.values())),
        "forward_dynamics": (_block("vdot", accelerations),),
        "energy": (_block("energy", energy),),
    }
    if "mass" in (terms or ()):
        blocks["mass"] = (_whole("M", M, n),)
    if "partials" in (terms or ()):
        blocks["partials"] = (_whole("K", K, n), _whole("C", {}, n), _whole("M", M, n))
    return System(
        bar.name,
        tape,
        tuple(Factor("R", name, k, 1, k, 1) for k, name in enumerate(nodes)),
        {name: _function(name, outputs) for name, outputs in blocks.items() if terms is None or name in terms},
        tuple(Quantity(item.name, item.value, 1, item.unit, item.description) for item in bar.parameters),
        (),
        (),
        (),
        bar.displacements,
        (0.0,) * n,
        tuple(range(-1, n - 1)),
        Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False, conservative=True),
        angular=(False,) * n,
        patterns={"K": tuple(K), "M": tuple(M)},
    )


def _nodes(bar: Bar) -> tuple[str, ...]:
    return tuple(f"node{k + 1}" for k in range(len(bar.displacements)))


def _assembled(bar: Bar, diagonal: Scalar, beside: Scalar) -> Entries:
    """Return the nonzeros of the matrix of equal elements [diagonal beside; beside diagonal]."""
    n = len(bar.displacements)
    twice = diagonal + diagonal
    entries: Entries = {}
    for row in range(n):
        if row and not beside.is_zero:
            entries[row, row - 1] = beside
        entries[row, row] = diagonal if bar.free_end and row == n - 1 else twice
        if row < n - 1 and not beside.is_zero:
            entries[row, row + 1] = beside
    return entries


def _product(entries: Entries, x: Sequence[Scalar]) -> list[Scalar]:
    """Return a matrix that has a diagonal times x."""
    result = [entries[row, row] * x[row] for row in range(len(x))]
    for (row, column), entry in entries.items():
        if row != column:
            result[row] = result[row] + entry * x[column]
    return result


def _solved(entries: Entries, right: Sequence[Scalar]) -> list[Scalar]:
    """Return the solution of a symmetric tridiagonal system by elimination."""
    pivots, x = [entries[0, 0]], [right[0]]
    for row in range(1, len(right)):
        pivot, value = entries[row, row], right[row]
        if (row, row - 1) in entries:
            beside = entries[row, row - 1]
            share = beside / pivots[-1]
            pivot, value = pivot - share * beside, value - share * x[-1]
        pivots.append(pivot)
        x.append(value)
    for row in reversed(range(len(right))):
        if (row, row + 1) in entries:
            x[row] = x[row] - entries[row, row + 1] * x[row + 1]
        x[row] = x[row] / pivots[row]
    return x


def _sum(algebra: Algebra, terms: Sequence[Scalar]) -> Scalar:
    return sum(terms, algebra.zero)


def _block(name: str, values: Iterable[Scalar]) -> Block:
    refs = tuple(value.ref for value in values)
    return Block(name, (len(refs),), refs)


def _whole(name: str, entries: Entries, n: int) -> Block:
    refs = (entries[row, column].ref if (row, column) in entries else ZERO for row in range(n) for column in range(n))
    return Block(name, (n, n), tuple(refs))


def _function(name: str, outputs: tuple[Block, ...]) -> Function:
    term = TERMS[name]
    return Function(name, term.description, tuple(x for x in term.inputs if x in ("p", "q", "v", "a")), outputs)


BARS = FrontEnd("bars", Bar, describe, derive)
