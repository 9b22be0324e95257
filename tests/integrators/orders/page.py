"""The page of orders, which is built with the site: slopes of every method of the register on every group and kind of
scene, or why it refuses.

python -m tests.integrators.orders.page      measures all slopes anew, and writes measured.json
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import eomgen
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import BUILT_IN
from tests.integrators.orders.checks import listed
from tests.integrators.orders.scenes import KINDS, MECHANISMS, Kind, absolute_scene
from tests.integrators.orders.slopes import SERIES_ORDER, declared, made, refusal, slopes, subjects

MEASURED = Path(__file__).with_name("measured.json")
COMMAND = "python -m tests.integrators.orders.page"
#: Slopes by group, or why there are none.
Cell = Mapping[str, float] | str

INTRODUCTION = """# Orders of the methods

By which power of the step errors fall, measured: each method of the register on six kinds of scenes, each of which has
mechanisms on R^n, SO(3), SE(3) and R^3 x SO(3) that do not touch one another. A cell has their slopes in this order: of
positions, velocities and multipliers the one farthest from the order that the method declares. Tests
hold slopes within 0.1 of orders up to 2, 0.2 of 3 and 4, and 0.4 above, and this command measures all anew:

    {command}

- R^n: a pole on a cart between springs; SO(3): a top on a ball joint; SE(3): a body that flies on a damped spring;
  R^3 x SO(3): the same in absolute coordinates. In loops a rod ties the pole to a slide, and the others to the base;
  drivers are a law for the cart, and laws for the lengths of the rods. A moving base travels and turns about two axes.
  Internal states follow the motion late, and push it.
- Errors are norms over four times in 0.8 s against SciPy's DOP853 at a tolerance of 3e-14 on accelerations alone
  (`model.rhs`), which knows no stepper. A slope is fitted to the three finest of 8 to 1024 equal steps whose errors are
  above rounding.
- Methods that choose their steps take equal ones here, from row to row of an input, at tolerances that let them. How
  errors follow tolerances is described [elsewhere](accuracy.md). `taylor` takes series of order {series}.
- A method is refused by what its row of the register needs. Parameters are its own defaults; `newmark_index3` damps
  with alpha = 0.05.

"""


def names() -> tuple[str, ...]:
    """Return the names of all methods of the register, aliases left out."""
    return tuple(row.name for family in BUILT_IN for row in family.names())


def refusals(kind: Kind) -> dict[str, str]:
    """Return why methods do not run on a kind of scene, by their names; empty for those that do."""
    facts, found = eomgen.derive(absolute_scene(kind)).facts, {}
    for name in names():
        method = made(name)
        found[name] = method if isinstance(method, str) else refusal(method, facts)
    return found


def measured() -> dict[str, dict[str, dict[str, float]]]:
    """Return the slopes that were measured last, by kind of scenes, method and group."""
    kinds = json.loads(MEASURED.read_text(encoding="utf-8"))
    return {
        kind: {name: dict(zip(MECHANISMS, row, strict=True)) for name, row in rows.items()}
        for kind, rows in kinds.items()
    }


def slopes_of(kind: Kind) -> dict[str, dict[str, float]]:
    """Measure the slopes of all methods that run on a kind of scenes."""
    return {name: worst_slopes(name, kind) for name, reason in refusals(kind).items() if not reason}


def worst_slopes(name: str, kind: Kind) -> dict[str, float]:
    """Return for each group the slope that is farthest from the declared order."""
    every = [item for subject in subjects(kind) for item in slopes(name, subject).items()]
    return {
        group: max((slope for (_, owner), slope in every if owner == group), key=lambda one: abs(one - declared(name)))
        for group in MECHANISMS
    }


def page() -> str:
    """Return the text of the page, from the measured slopes and the reasons of refused methods."""
    columns: dict[str, dict[str, Cell]] = {}
    for kind in KINDS:
        known = measured()[kind.name]
        columns[kind.name] = {name: reason or known[name] for name, reason in refusals(kind).items()}
    reasons = list(
        dict.fromkeys(cell for column in columns.values() for cell in column.values() if isinstance(cell, str))
    )
    lines = [f"| method | order | {' | '.join(columns)} |", f"|---|---:|{'---|' * len(columns)}"]
    for name in names():
        row = [_shown(column[name], reasons) for column in columns.values()]
        method = made(name)
        lines.append(f"| `{name}` | {declared(name) if isinstance(method, Family) else ''} | {' | '.join(row)} |")
    table, notes = "\n".join(lines), [f"- ({_letter(reasons, reason)}) {reason}\n" for reason in reasons]
    head = INTRODUCTION.format(command=COMMAND, series=SERIES_ORDER)
    return f"{head}{table}\n\nRefused:\n\n{''.join(notes)}\n## What else tests hold\n\n{listed()}"


def written(kinds: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """Return the text of the file of slopes: a line for each method."""
    parts = []
    for kind, rows in kinds.items():
        lines = (f'    "{name}": {[round(slope, 2) for slope in row.values()]}' for name, row in rows.items())
        parts.append(f'  "{kind}": {{\n' + ",\n".join(lines) + "\n  }")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _shown(cell: Cell, reasons: list[str]) -> str:
    if isinstance(cell, str):
        return f"refused ({_letter(reasons, cell)})"
    return " ".join(f"{slope:.2f}" for slope in cell.values())


def _letter(reasons: list[str], reason: str) -> str:
    return "abcdefghijkl"[reasons.index(reason)]


if __name__ == "__main__":
    MEASURED.write_text(written({kind.name: slopes_of(kind) for kind in KINDS}), encoding="utf-8")
    print(MEASURED)
