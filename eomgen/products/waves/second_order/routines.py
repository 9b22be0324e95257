"""The compiled routines of a case: tables of components and pairs, and sums over them."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.codegen.program import NEST_LIMIT
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.codegen.targets.c.printer import Printer, indent_lines, wrap_text
from eomgen.codegen.targets.c.templates import environment
from eomgen.products.waves.second_order.pairs import COLUMNS, OWN, Case, Dispersion, PairTape, gravity_waves
from eomgen.symbolic.tape import Ref, Tape
from eomgen.toolchain.builder import Builder


def kinematics_of(spread: bool) -> tuple[str, ...]:
    """Return the names of the sums of the motion, in order."""
    return ("dx", "dy", "dz", "vx", "vy", "vz", "ax", "ay", "az", "p") if spread else (
        "dx", "dz", "vx", "vz", "ax", "az", "p",
    )  # fmt: skip


def geometry_of(spread: bool) -> tuple[str, ...]:
    """Return the names of the sums of derivatives by labels, in order."""
    if not spread:
        return ("xxa", "xza", "xxaa", "xzaa")
    return tuple(f"x{axis}{by}" for by in ("a", "b", "aa", "ab", "bb") for axis in "xyz")


def statements(
    tape: Tape, refs: Sequence[Ref], inputs: Mapping[str, str | Sequence[str]], targets: Sequence[str], depth: int
) -> str:
    """Return the C that evaluates references on a tape, indented by ``depth`` levels.

    Parameters
    ----------
    inputs : by block, the C expressions of numbers, or one expression with a gap for the number
    targets : C expressions of the results
    """
    plan = schedule(tape, [refs], tuple(inputs), 10**9, NEST_LIMIT, fill=False, reroll=False)
    return indent_lines(Printer(inputs, [targets]).lines(plan.parts[0].statements), depth)


def sources(case: Case, dispersion: Dispersion = gravity_waves) -> tuple[str, str]:
    """Return two texts of C for a case: the tables of components and pairs, and the sums over these."""
    pair_tape = PairTape(case, dispersion)
    planes = [f"columns[{number} * n + {{}}]" for number in range(len(COLUMNS))]

    inputs = {"k": "k[{}]", "p": "p[{}]", **{x: [plane.format(x) for plane in planes] for x in "ij"}}

    def body(refs: Sequence[Ref], targets: Sequence[str], depth: int) -> str:
        return statements(pair_tape.tape, refs, inputs, targets, depth)

    targets = [f"table[{number} * pairs + at]" for number in range(len(case.entries))]
    col, self_rows, entries = ({name: row for row, name in enumerate(names)} for names in (COLUMNS, OWN, case.entries))
    words = [
        "a bottom" if case.finite else "no bottom",
        "several directions" if case.spread else "one direction",
        "the surface c = 0" if case.surface else "any depth c",
    ]
    shared = {"case": ", ".join(words), "finite": case.finite, "spread": case.spread, "entries": case.entries}
    coefficients = (
        environment()
        .get_template("waves/coefficients.c.jinja")
        .render(
            **shared,
            columns=COLUMNS,
            w=COLUMNS.index("w"),
            same=1e-7,  # relative difference of equal frequencies
            component=body(pair_tape.component, [plane.format("m") for plane in planes], 2),
            own=body(pair_tape.own, [f"own[{number} * n + i]" for number in range(len(OWN))], 2),
            of_own=OWN,
            pair=body(pair_tape.pair, targets, 4),
            degenerate=body(pair_tape.degenerate, targets, 4) if case.spread else "",
        )
    )
    sums = (
        environment()
        .get_template("waves/sums.c.jinja")
        .render(
            **shared,
            col=col,
            ent=entries,
            own=self_rows,
            has_sums="Xp" in entries,
            kinematics=kinematics_of(case.spread),
            geometry=geometry_of(case.spread),
        )
    )
    return wrap_text(coefficients), wrap_text(sums)


@dataclass(frozen=True)
class Routines:
    """Compiled routines for a case: tables of components and of pairs, and sums over components at labels."""

    case: Case
    _tables: tuple[Any, Any]
    _sums: tuple[Any, Any]

    @property
    def lanes(self) -> int:
        """How many labels are taken side by side."""
        return int(self._sums[1].eomgen_wave_lanes())

    def table(self, name: Literal["components", "own", "pairs"], rows: Array, p: Array) -> Array:
        """Return a table by (g, h, c): ``components``, (len(COLUMNS), n), from their wave vectors (n, 2); from this
        table their self-interactions (``own``), (len(OWN), n), or ``pairs``, (entries, n (n - 1)/2)."""
        ffi, lib = self._tables
        n = len(rows) if name == "components" else rows.shape[1]
        entries = len(self.case.entries), n * (n - 1) // 2
        result = np.empty({"components": (len(COLUMNS), n), "own": (len(OWN), n), "pairs": entries}[name])
        arrays = (np.ascontiguousarray(rows, dtype=float), p, result)
        getattr(lib, f"eomgen_wave_{name}")(n, *(ffi.from_buffer("double[]", array) for array in arrays))
        return result

    def sums(
        self,
        name: Literal["kinematics", "geometry"],
        columns: Array,
        waves: LabelledWaves,
        self_table: Array,
        table: Array | None,
        labels: Array,
        *more: Array,
    ) -> dict[str, Array]:
        """Return sums over components at labels (2, points), by name, (points,) each; without a table of first order.
        ``columns`` and ``self_table`` are tables of components, ``table`` of pairs. ``kinematics`` takes the level and
        (g, h, c) as ``more``."""
        names = kinematics_of(self.case.spread) if name == "kinematics" else geometry_of(self.case.spread)
        ffi, lib = self._sums
        lanes, count, n = self.lanes, labels.shape[1], columns.shape[1]
        filled = -(-count // lanes) * lanes
        padded = np.zeros((2, filled))
        padded[:, :count] = labels
        outputs = np.empty((len(names), filled))
        room = np.empty(2 * n * lanes + 8)  # lanes are read and written at multiples of the longest register
        start = -room.ctypes.data // 8 % 8

        def of(array: Array) -> Any:
            return ffi.from_buffer("double[]", array)

        function, pairs = getattr(lib, f"eomgen_wave_{name}"), ffi.NULL if table is None else of(table)
        function(
            n, of(columns), of(waves.amplitude), of(waves.phase), of(self_table), pairs,
            *map(of, more), waves.time, filled, of(padded), of(outputs), of(room[start:]),
        )  # fmt: skip
        return dict(zip(names, outputs[:, :count], strict=True))


@dataclass(frozen=True)
class LabelledWaves:
    """Amplitudes and phases at the label 0 and the time ``time``, (n,) each."""

    amplitude: Array
    phase: Array
    time: float


@functools.lru_cache(maxsize=32)
def routines(case: Case, dispersion: Dispersion = gravity_waves) -> Routines:
    """Return the compiled routines of a case, from the cache if present."""
    tables, sums = sources(case, dispersion)
    return Routines(case, routine(Builder(), tables), routine(Builder(real="lanes"), sums))


def routine(builder: Builder, text: str) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of C, with the functions that the text exports."""
    exported = re.findall(r"^EG_SEEN ([^{]*\))", text, re.MULTILINE)
    return builder.build_routine(text, "".join(f"{head};\n" for head in exported))
