"""Functions of the Taylor recurrence as parts of a Program: start, next order, scales of rounding errors, and the times
at which a series must end (breakpoints).

Breakpoints are instants at which the equations on a tape are not analytic. Low-order methods step over the breaks of
smooth splines without loss of order (see ``formula.discontinuities``), and so do steps by accelerations and their
rates; a Taylor series must end at every break.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from eomgen.base.messages import listed
from eomgen.codegen.program import NEST_LIMIT, PART_LIMIT, WIDEST, OutputArray, ProgramFunction
from eomgen.codegen.scheduling.bodies import Bodies
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.codegen.series.recurrence import NEXT, Recurrence, inverse_serves
from eomgen.errors import ModelError, Problem
from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.series import KEPT, LEFT, ORDER, PREVIOUS, RIGHT, SUMS, Series, SeriesTerm
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import OBSERVED, Discontinuity, System

#: Operations with kinks or jumps. A selection switches with the condition, which is among these.
_NON_SMOOTH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE})
#: Origin of breakpoints that no formula of the scene has.
_OF_BEAMS = (
    " (elements of geometrically exact beams have these: the rotation vector between two nodes is one formula next to"
    " no rotation and another next to half a turn)"
)
#: Blocks that do not change during a run.
_CONSTANT = frozenset({"p", "u", "followed"})


def has_nodes(system: System) -> bool:
    """Return whether a system has geometrically exact beams: only names of beam nodes have a dot."""
    return any("." in body for body in system.bodies)


def refuse_external(system: System) -> None:
    """Raise ModelError if equations of motion call external functions, whose higher derivatives are not known."""
    refs = [ref for name, item in system.functions.items() if name not in OBSERVED for ref in item.refs]
    tape = system.tape
    called = [tape.maps[tape.a[node]] for node in tape.live(refs) if tape.op[node] is Op.MAP]
    labels = dict.fromkeys(item.label for item in called if isinstance(item, Call))
    if labels:
        fault = (
            f"a series in time needs derivatives of all orders, and {listed(labels)} has values and slopes"
            f" alone [E0214]"
        )
        raise ModelError(Problem("method", fault, "rk4 or generalized_alpha"))


def breakpoints_in_time(source: Tape, *, nodes: bool = False) -> tuple[Discontinuity, ...]:
    """Return the times at which an operation of the tape is not analytic, sorted, each once with the period.

    Only operations with kinks or jumps, and breaks of curves, whose arguments are linear in time give such times;
    operations of parameters and held inputs alone are skipped. ``nodes``: whether geometrically exact beams are among
    the recorded bodies, for the message.

    Raises
    ------
    ModelError
        The time of a breakpoint depends on coordinates, on tunable parameters, or nonlinearly on time.
    """
    by_time: dict[tuple[float, float], Discontinuity] = {}
    unknown: list[str] = []
    for node in range(1, len(source.op)):
        op, operands = source.op[node], source.operands(node)
        if op not in _NON_SMOOTH and op is not Op.CURVE:
            continue
        blocks = {symbol.block for symbol in source.depends_on(operands)} - _CONSTANT
        lines = [line for ref in operands if (line := _line(source, ref)) is not None]
        if len(lines) == len(operands):
            by_time |= {(item.time, item.period): item for item in _breakpoints(source, node, lines)}
        elif blocks:
            curve = source.curves[source.b[node]][0].name if op is Op.CURVE else ""
            operation = f"the pieces of curve {curve!r}" if op is Op.CURVE else f"{op.name.lower()}()"
            decider = "the motion" if blocks - {"t"} else "a tunable parameter or a formula that is not linear in time"
            unknown.append(f"{operation}, decided by {decider}")
    if unknown:
        listed = "; ".join(dict.fromkeys(unknown))
        needs = "a Taylor series needs smooth equations, or discontinuities at known times [E0215]"
        fault = f"{needs}; here are {listed}{_OF_BEAMS if nodes else ''}"
        raise ModelError(Problem("method", fault, "rk4 or generalized_alpha"))
    return tuple(by_time[key] for key in sorted(by_time))


def _line(tape: Tape, ref: Ref) -> tuple[float, float] | None:
    """Return (a, b) if a reference is a t + b with constants, else None."""
    node, sign = abs(ref), 1.0 if ref > 0 else -1.0
    number = tape.number(node)
    if number is not None:
        return 0.0, sign * number
    if tape.symbol(node) == InputSymbol("t", 0):
        return sign, 0.0
    if tape.op[node] not in (Op.ADD, Op.SUB, Op.MUL):
        return None
    first, second = (_line(tape, operand) for operand in tape.operands(node))
    if first is None or second is None:
        return None
    if tape.op[node] is not Op.MUL:
        side = 1.0 if tape.op[node] is Op.ADD else -1.0
        return sign * (first[0] + side * second[0]), sign * (first[1] + side * second[1])
    if first[0] and second[0]:
        return None
    return sign * (first[0] * second[1] + second[0] * first[1]), sign * first[1] * second[1]


def _breakpoints(tape: Tape, node: int, lines: list[tuple[float, float]]) -> Iterator[Discontinuity]:
    (a, b), (c, d) = lines[0], lines[1] if len(lines) > 1 else (0.0, 0.0)
    if a == c:
        return
    if tape.op[node] is not Op.CURVE:
        yield Discontinuity((d - b) / (a - c), 0.0, 0, (abs(b) + abs(d)) / abs(a - c))
        return
    curve = tape.curves[tape.b[node]][0]
    period = float(curve.breaks[-1] - curve.breaks[0]) / abs(a) if curve.outside == "periodic" else 0.0
    for time in curve.breaks:
        yield Discontinuity((float(time) - b) / a, period, 0, (abs(float(time)) + abs(b)) / abs(a))


#: Input blocks of both functions, in the order of arguments.
START_BLOCKS = ("p", "t", "q", "v", "z", "u", "followed")
NEXT_BLOCKS = (*NEXT.values(), SUMS, LEFT, RIGHT, KEPT, PREVIOUS, ORDER)


def series_functions(
    system: System, bodies: Bodies
) -> tuple[tuple[ProgramFunction, ...], dict[str, Any], tuple[Discontinuity, ...]]:
    """Return the functions of the Taylor recurrence, the data of the stepper's templates, and the times at which a
    series ends.

    Functions: ``series_start``, ``series_next`` and, if the scene has scales of rounding, ``extent``. Data: sizes,
    ``products``, ``kept``, ``previous``, and ``room`` of a row of products; ``factors``, the places of both factors of
    each product, and ``kinds``: which components of q and of v are angles, and which are lengths. ``bodies`` are of
    the Program, whose curves are extended. Raises ModelError without a series.
    """
    refuse_external(system)
    recurrence = Recurrence(system, by_inverse=inverse_serves(system))
    breakpoints = breakpoints_in_time(recurrence.source, nodes=has_nodes(system))
    series, tape = recurrence.series, recurrence.series.tape
    per_next = tape.input(ORDER, 2)
    start: list[tuple[str, Sequence[Ref], str]] = [
        ("left_0", [term.value for term in series.left], "left factors of the products"),
        ("right_0", [term.value for term in series.right], "right factors"),
        ("kept_0", series.kept, "values used by coefficients of all orders"),
        ("previous_0", [term.value for term in series.previous], "slopes of functions of arguments linear in time"),
    ]
    later: list[tuple[str, Sequence[Ref], str]] = [
        ("left_k", [term.next for term in series.left], "coefficient k of the left factors, or k times it"),
        ("right_k", [term.next for term in series.right], "coefficient k of the right factors"),
        ("previous_k", [term.next for term in series.previous], "coefficient k of the slopes"),
    ]
    for block, terms in sorted(recurrence.rates.items()):
        start.append((f"{block}_1", [term.value for term in terms], f"rate of {block}"))
        coefficients = [tape.mul(per_next, term.next) for term in terms]
        later.append((f"{block}_next", coefficients, f"coefficient k + 1 of {block}"))
    functions = [
        program_function(tape, "series_start", "values at order 0, and coefficient 1", START_BLOCKS, start, bodies),
        program_function(tape, "series_next", "coefficient k + 1 from those before it", NEXT_BLOCKS, later, bodies),
    ]
    functions += extent_function(system, bodies)
    room = -(-len(series.left) // WIDEST) * WIDEST  # whole vectors
    needed = {
        "products": len(series.left),
        "kept": len(series.kept),
        "previous": len(series.previous),
        "room": room,
        "factors": _factors(series),
        "kinds": kinds(system),
    }
    return tuple(functions), needed, breakpoints


def _factors(series: Series) -> list[list[tuple[str, int]]]:
    """Return for each product both factors as (``LEFT`` or ``RIGHT``, index). A quantity that is a factor of several
    products has one place, the first, so that coefficients are read once."""
    places: dict[SeriesTerm, tuple[str, int]] = {}
    for side, terms in ((LEFT, series.left), (RIGHT, series.right)):
        for number, term in enumerate(terms):
            places.setdefault(term, (side, number))
    return [[places[left], places[right]] for left, right in zip(series.left, series.right, strict=True)]


def extent_function(system: System, bodies: Bodies) -> list[ProgramFunction]:
    """Return the function of the size of the machine and of gravity, if present."""
    if not system.extent:
        return []
    sizes = [("extent", system.extent, "size of the machine, m, and of gravity, m/s^2")]
    return [program_function(system.tape, "extent", "scales of rounding", ("p",), sizes, bodies)]


def kinds(system: System) -> list[dict[str, Any]]:
    """Return the components of q and v that are angles, and that are lengths, as mappings with ``name, q, v``.
    Quaternions are angles; a kind without components of v is left out. ``q_adjacent`` and ``v_adjacent`` say whether
    the components follow one another."""
    members: dict[str, tuple[list[int], list[int]]] = {"angle": ([], []), "length": ([], [])}
    for factor in system.factors:
        if factor.group == "R":
            of_v = of_q = list((system.angular or (True,) * system.nv)[factor.v])
        else:
            of_q, of_v = (
                [k < turning for k in range(size)] for turning, size in ((4, factor.q_size), (3, factor.v_size))
            )
        for k, turns in enumerate(of_q):
            members["angle" if turns else "length"][0].append(factor.q_start + k)
        for k, turns in enumerate(of_v):
            members["angle" if turns else "length"][1].append(factor.v_start + k)
    return [
        {"name": name, "q": q, "v": v, "q_adjacent": _adjacent(q), "v_adjacent": _adjacent(v)}
        for name, (q, v) in members.items()
        if v
    ]


def _adjacent(components: Sequence[int]) -> bool:
    return list(components) == list(range(components[0], components[0] + len(components)))


def program_function(
    tape: Tape,
    name: str,
    description: str,
    blocks: Sequence[str],
    outputs: Sequence[tuple[str, Sequence[Ref], str]],
    bodies: Bodies,
) -> ProgramFunction:
    """Return a function of a Program from references on a tape. ``blocks`` are the possible input blocks in the order
    of arguments; unused ones are left out. ``outputs`` are (label, references, description); outputs without references
    are left out. ``bodies`` is extended."""
    present = [output for output in outputs if output[1]]
    refs, unshared = [of_output for _, of_output, _ in present], Bodies(curves=bodies.curves)
    made = schedule(tape, refs, blocks, PART_LIMIT, NEST_LIMIT, unshared, fill=False, reroll=False)
    used = {block for part in made.parts for block in part.inputs}
    return ProgramFunction(
        name=name,
        description=description,
        inputs=tuple(block for block in blocks if block in used),
        outputs=tuple(OutputArray(label, label, (len(refs),), len(refs), text) for label, refs, text in present),
        parts=made.parts,
        workspace=made.workspace,
        operations=made.operations,
        counts={},
    )
