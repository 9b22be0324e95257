"""Passes of a function of few live values: groups of outputs, with the time that a card is expected to take for each.

A function that is scheduled with ``LIVE_LIMIT`` has parts that compute some outputs from the inputs. One kernel runs
the parts one after the other; a pass is a group of parts that needs no other part, so that the passes of a small batch
may run in kernels of their own. Figures are predictions, from counts by NVRTC 13.5 for sm_90 and from rates measured on
an H100.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from eomgen.base.data import dataclass
from eomgen.codegen.program import FunctionPart, Program, ProgramFunction
from eomgen.products.gpu.live_values import live_values

#: Live values of a part at most, for ``to_program``. 255 registers of 32 bits hold about 110 numbers; the rest of 256
#: threads fits into shared memory or the first-level cache.
LIVE_LIMIT = 175
#: Live values that stay in registers, at least.
REGISTERS = 88
#: Bytes and operations in double per second (H100, measured).
BANDWIDTH, RATE = 2.99e12, 15.8e12
#: Instructions of an operation, with products fused and without, and of a sine with a cosine.
FUSED, SEPARATE, SINE_AND_COSINE = 0.67, 1.03, 43


@dataclass(frozen=True)
class Pass:
    """A group of parts of a function that needs no other part.

    Attributes
    ----------
    parts : numbers of the parts, in order
    outputs : (name, first component, end) of the ranges that the parts store
    live : largest number of live values
    stack : expected bytes of a thread's memory: values beyond registers, and values that pass between parts
    seconds : expected time of a state in a large batch
    """

    parts: tuple[int, ...]
    outputs: tuple[tuple[str, int, int], ...]
    live: int
    stack: int
    seconds: float


def passes(program: Program, name: str, *, fused: bool = True) -> tuple[Pass, ...]:
    """Return the passes of a function of a Program, in order.

    Parameters
    ----------
    fused : whether products are fused with sums, which changes bits

    Examples
    --------
    >>> from eomgen import derive, load
    >>> from eomgen.codegen.convert import to_program
    >>> program = to_program(derive(load("scene.toml"), ["partials"]), live_limit=LIVE_LIMIT)  # doctest: +SKIP
    >>> [(item.outputs, item.live) for item in passes(program, "partials")]  # doctest: +SKIP
    """
    function = program.function(name)
    together = tuple(k for k, part in enumerate(function.parts) if part.workspace)
    alone = [(k,) for k, part in enumerate(function.parts) if not part.workspace]
    groups = sorted([together, *alone] if together else alone)
    return tuple(_pass(program, function, numbers, fused=fused) for numbers in groups)


def _pass(program: Program, function: ProgramFunction, numbers: Sequence[int], *, fused: bool) -> Pass:
    parts = [function.parts[k] for k in numbers]
    outputs = tuple(_ranges(function, parts))
    read = {block for part in parts for block in part.inputs}
    moved = sum(map(program.input_size, read)) + sum(end - first for _, first, end in outputs)
    live = max(map(live_values, parts))
    kept = function.workspace if len(parts) > 1 else 0
    return Pass(
        tuple(numbers),
        outputs,
        live,
        8 * (kept + max(0, live - REGISTERS)),
        max(8 * moved / BANDWIDTH, sum(_instructions(part, fused=fused) for part in parts) / RATE),
    )


def _instructions(part: FunctionPart, *, fused: bool) -> float:
    circular = sum(statement.kind == "sincos" for statement in part.statements)
    return (FUSED if fused else SEPARATE) * (part.operations - circular) + SINE_AND_COSINE * circular


def _ranges(function: ProgramFunction, parts: Iterable[FunctionPart]) -> Iterator[tuple[str, int, int]]:
    """Yield (name, first component, end) of the ranges that parts store; the whole output if a loop stores some."""
    stored: dict[int, set[int]] = {}
    for part in parts:
        single = [statement.data[:2] for statement in part.statements if statement.kind == "out"]
        loops = [statement.data[3] for statement in part.statements if statement.kind == "repeat"]
        whole = set(part.outputs) - {number for number, _ in single}
        whole |= {statement.data[0] for statement in part.statements if statement.kind == "fill"}
        whole |= {target[1] for targets in loops for target in targets if isinstance(target[1], int)}
        for number, component in single:
            stored.setdefault(number, set()).add(component)
        for number in whole:
            stored[number] = set(range(function.outputs[number].size))
    for number, components in sorted(stored.items()):
        places = sorted(components)
        cuts = [0, *(k for k, (x, y) in enumerate(pairwise(places), 1) if y > x + 1), len(places)]
        for begin, end in pairwise(cuts):
            yield function.outputs[number].name, places[begin], places[end - 1] + 1
