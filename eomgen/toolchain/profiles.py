"""Build profiles: a row for each, with flags of the C compiler and all else that builds decide by their profile."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.errors import Problem, ToolchainError


@dataclass(frozen=True)
class CompilerProfile:
    """All that builds decide by their profile.

    Attributes
    ----------
    flags : of the compiler
    native : whether the code may only be reused on the same kind of processor
    on_tape : whether long functions of the model are not C but code of the tape engine
    split : whether compilers work in the background: long libraries come in two, functions that runs call first, long
        steppers are compiled while functions are scheduled, and companions for batches are compiled unasked
    short_runs : profile by which a short first run may be stepped in place of this one, if any
    successor : profile of the library that takes the place of this one in the background, if any
    other_numbers : whether the library of a model that differs in numbers alone is taken
    """

    name: str
    flags: tuple[str, ...]
    native: bool = False
    on_tape: bool = False
    split: bool = False
    short_runs: str = "instant"
    successor: str = ""
    other_numbers: bool = True


#: The variable that names the default profile, and the default profile without the variable.
PROFILE_VARIABLE = "EOMGEN_PROFILE"
STANDARD_PROFILE = os.environ.get(PROFILE_VARIABLE) or "fast"

_SUCCESSOR = "fast" if STANDARD_PROFILE == "instant" else STANDARD_PROFILE

_INSTANT = ("-O0", "-ffp-contract=off", "-DEOMGEN_ON_TAPE")
_FAST = (
    "-O2",
    "-march=native",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-tree-slp-vectorize",
)

#: ``fast``: this processor's instructions, fused multiply-add, no errno; these flags keep NaN, infinities and the order
#: of sums. No vectors of neighbouring statements: gcc 12.2 makes wrong code of such vectors with 512-bit registers, and
#: the vectors save no time here. ``reproducible``: the same bits on every IEEE machine, and as the command in an
#: emitted manifest gives. ``quick``: for tests. ``instant``: the least work for a compiler; the bits of
#: ``reproducible``.
_ROWS = (
    CompilerProfile("fast", _FAST, native=True, split=True),
    CompilerProfile("reproducible", ("-O2", "-ffp-contract=off"), split=True),
    CompilerProfile("quick", ("-O0", "-ffp-contract=off")),
    CompilerProfile("instant", _INSTANT, on_tape=True, short_runs="", successor=_SUCCESSOR, other_numbers=False),
)
PROFILES = {row.name: row for row in _ROWS}

#: Of the tape engine, which is compiled once: no fused products, so that results have the bits of ``reproducible``.
ENGINE_FLAGS = ("-O2", "-ffp-contract=off")

#: In place of ``-O2`` of gcc: the passes that change long functions without branches, at the same speed; without
#: peepholes a step of a vehicle takes 5 % longer. The passes left out (search for dead stores, partial redundancies
#: and equal values across blocks) take a quarter to a half of the compiler's time. Functions have the same bits; in
#: steppers other products may be fused with sums.
_WITHOUT_SLOW_PASSES = (
    "-O1",
    "-fexpensive-optimizations",
    "-fstrict-aliasing",
    "-finline-small-functions",
    "-ftree-loop-vectorize",
    "-fvect-cost-model=very-cheap",
    "-fno-tree-dse",
    "-fno-dse",
    "-fpeephole2",
)
#: Further passes that gcc leaves out for models whose functions have no branches: copies after registers are chosen,
#: which compare all pairs of entries of the workspace, a seventh of the compiler's time, the combination of
#: instructions, a tenth, and constants and equal values, which the templates do not write. Bits are the same, and times
#: of functions within 2 %.
AFTER_REGISTERS = (
    "-fdisable-rtl-postreload",
    "-fdisable-rtl-combine",
    "-fno-tree-ccp",
    "-fno-rerun-cse-after-loop",
    "-fno-cse-follow-jumps",
)
#: Of these functions also the analysis of pointers, and the search for values to move to memory, of which there are
#: thousands: a fifth of the compiler's time, and the chosen registers are as good.
_OF_FUNCTIONS = (*AFTER_REGISTERS, "-fno-tree-pta", "--param=lra-max-considered-reload-pseudos=10")
#: For files without any loop also the search for equal values in memory, an eighth of the compiler's time: common
#: operations are shared before printing, and the later passes find repeated loads.
OF_STRAIGHT = (*_OF_FUNCTIONS, "-fno-tree-fre")
#: For files with loops, as of the sines and cosines of all angles, the second of these searches alone: loops become
#: vectors by the first.
OF_ANGLES = (*_OF_FUNCTIONS, "-fdisable-tree-fre3")
#: The same for the long stepper of such a model, which is mostly an elimination without branches: also the search for
#: values that dominators know, copies of the heads of loops, and far searches for the last store to an address.
#: Compilers take two fifths less time; bits of the step of a car are the same, and its time within 1.5 %. Without the
#: search for equal values in memory bits of other steppers change, as of a quarter car.
OF_ELIMINATION = (
    *_OF_FUNCTIONS,
    "-fno-tree-dominator-opts",
    "-fno-tree-ch",
    "--param=sccvn-max-alias-queries-per-access=10",
)
#: Characters of a source with branches from which on the slow passes are left out. Steps of shorter models were up to
#: 5 % slower without these passes, and take at most a second to compile with them.
_LONG = 130_000
_GCC = r"\S*g?cc\S* \(.*?\) (\d+)\."


def compiler_seconds(functions: Sequence[Mapping[str, Any]], compilers: int, loops: int = 0) -> float:
    """Return an estimate of the seconds that compilers take for a library.

    Parameters
    ----------
    functions : of the library: ``operations`` of the text, and ``counts`` of operations by kind
    compilers : number of compilers at once
    loops : operations in the bodies of loops over elements
    """
    operations: int = sum(item["operations"] for item in functions)
    # gcc 12, two processors: an arm of 7 joints, a linkage of 4 bodies, a car of 18 bodies; loops of exact beams
    return 0.5 + (1.6e-4 * operations + 2.2e-4 * loops) / compilers


def run_seconds_on_tape(functions: Sequence[Mapping[str, Any]], steps: float) -> float:
    """Return an estimate of the time until the end of a run on the tape engine: each function once per step, and as
    many steps again for the estimate of the error.

    Parameters
    ----------
    functions : as of ``compiler_seconds``
    steps : of the run
    """
    operations: int = sum(item["operations"] for item in functions)
    evaluated: int = sum(sum(item["counts"].values()) for item in functions)
    # the stepper alone is compiled; an operation takes 1 to 3 ns, with the stepper, which is not optimised
    return 0.25 + 5e-6 * operations + 2.0 * steps * 3e-9 * evaluated


def profile(name: str) -> CompilerProfile:
    """Return a profile by name. Raises ToolchainError with the known names."""
    if name not in PROFILES:
        where = f"environment variable {PROFILE_VARIABLE}" if name == os.environ.get(PROFILE_VARIABLE) else ""
        raise ToolchainError(Problem(where, f"no build profile {name!r} [E2125]", f"one of {', '.join(PROFILES)}"))
    return PROFILES[name]


def without_slow_passes(flags: Sequence[str], version: str, further: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the flags with ``-O2`` replaced by faster passes of gcc that make code as fast; unchanged for others.

    Parameters
    ----------
    version : the first line of the compiler's text about its version
    further : flags that leave out more passes, if the compiler has these
    """
    gcc = re.match(_GCC, version)
    if gcc is None or int(gcc[1]) < 12:  # the first whose -O2 turns loops into vectors, as these flags say
        return tuple(flags)
    known = int(gcc[1]) <= 14 and platform.machine() in ("x86_64", "AMD64")
    passes = (*_WITHOUT_SLOW_PASSES, *(further if known else ()))
    return tuple(part for flag in flags for part in (passes if flag == "-O2" else (flag,)))


def beside_straight(source: str) -> tuple[str, ...]:
    """Return the further passes that are left out for a source of a model whose functions have no branches."""
    return OF_ELIMINATION if len(source) > _LONG else AFTER_REGISTERS


def passes_for(source: str, flags: Sequence[str], version: str, *, loops: bool = False) -> tuple[str, ...]:
    """Return the flags for a generated source: without the slow passes if the source is so long that these passes take
    seconds.

    Parameters
    ----------
    version : the first line of the compiler's text about its version
    loops : whether the source is of a model with loops over elements
    """
    # the bodies of loops over elements, straight and most of the text, are as fast without (beams of 800 elements)
    long = len(source) > (60_000 if loops else _LONG)
    return without_slow_passes(flags, version) if long else tuple(flags)
