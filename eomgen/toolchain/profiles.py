"""Build profiles: named sets of flags of the C compiler."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

from eomgen.base.data import dataclass
from eomgen.errors import Problem, ToolchainError


@dataclass(frozen=True)
class Profile:
    """A named set of flags. ``native`` code may only be reused on the same kind of processor."""

    name: str
    flags: tuple[str, ...]
    native: bool


_FAST = (
    "-O2",
    "-march=native",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-tree-slp-vectorize",
)

#: ``fast``: this processor's instructions, fused multiply-add, no errno; all of it keeps NaN, infinities and the order
#: of sums. No vectors of neighbouring statements: gcc 12.2 makes wrong code of them with 512-bit registers, and they
#: are no gain here. ``reproducible``: the same bits on every IEEE machine, and as the command in an emitted manifest
#: gives. ``quick``: for tests.
PROFILES = {
    "fast": Profile("fast", _FAST, True),
    "reproducible": Profile("reproducible", ("-O2", "-ffp-contract=off"), False),
    "quick": Profile("quick", ("-O0", "-ffp-contract=off"), False),
}

#: In place of ``-O2`` of gcc: the passes that change long functions without branches, at the same speed. Those left
#: out (search for dead stores, partial redundancies and equal values across blocks) take a quarter to a half of its
#: time. Functions have the same bits; in steppers other products may be fused with sums.
_WITHOUT_SLOW_PASSES = (
    "-O1",
    "-fexpensive-optimizations",
    "-fstrict-aliasing",
    "-finline-small-functions",
    "-ftree-loop-vectorize",
    "-fvect-cost-model=very-cheap",
    "-fno-tree-dse",
    "-fno-dse",
)
#: Characters of a source with branches from which on the slow passes are left out. Steps of shorter models were up to
#: 5 % slower without these passes, and take at most a second to compile with them.
_LONG = 130_000
#: First gcc whose ``-O2`` turns loops into vectors, as these flags say; others are called with ``-O2``.
_FIRST_GCC = 12
_GCC = re.compile(r"\S*g?cc\S* \(.*?\) (\d+)\.")

#: The variable that names the default profile, and the profile without it.
PROFILE_VARIABLE = "EOMGEN_PROFILE"
STANDARD_PROFILE = os.environ.get(PROFILE_VARIABLE) or "fast"


def profile(name: str) -> Profile:
    """Return a profile by name. Raises ToolchainError with the known names."""
    if name not in PROFILES:
        where = f"environment variable {PROFILE_VARIABLE}" if name == os.environ.get(PROFILE_VARIABLE) else ""
        raise ToolchainError(Problem(where, f"no build profile {name!r}", f"one of {', '.join(PROFILES)}"))
    return PROFILES[name]


def without_slow_passes(flags: Sequence[str], version: str) -> tuple[str, ...]:
    """Return flags that make the same code of generated C in less time.

    Parameters
    ----------
    version : the first line that the compiler prints about itself
    """
    gcc = _GCC.match(version)
    if gcc is None or int(gcc[1]) < _FIRST_GCC:
        return tuple(flags)
    return tuple(part for flag in flags for part in (_WITHOUT_SLOW_PASSES if flag == "-O2" else (flag,)))


def passes_for(source: str, flags: Sequence[str], version: str) -> tuple[str, ...]:
    """Return the flags for a generated source: without the slow passes if it is so long that they take seconds.

    Parameters
    ----------
    version : the first line that the compiler prints about itself
    """
    return without_slow_passes(flags, version) if len(source) > _LONG else tuple(flags)
