"""The page of doubts, made of the rows of the registers; ``python -m docs.site.doubts`` prints it."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator

from eomgen.base.limits import Limit
from eomgen.base.products import rows_of
from eomgen.compiled.rest.state_warnings import GROUP, StateWarning
from eomgen.scene.document.notes import every_note
from eomgen.simulation.judgement.register import CHECKS

_HEAD = """# Doubts and limits

Every note on a scene, warning of an equilibrium and check of a run is a row of a register. A number beyond its limit is
doubted; a number at the limit is not. A choice is a limit without a derivation. [Findings](../guide/index.md) have
severity and value. `python -m docs.site.doubts` prints this page.
"""


def table(rows: Iterable[tuple[str, tuple[Limit, ...]]]) -> Iterator[str]:
    """Yield the lines of a table of rows by name, with their limits."""
    yield from ("| doubt | limit | of | source |", "|---|---|---|---|")
    for name, limits in rows:
        if not limits:
            yield f"| `{name}` | | | |"
        for limit in limits:
            number = str(limit).removeprefix(limit.meaning)
            yield f"| `{name}` |{number} | {limit.meaning} | {limit.source} |"


def page() -> str:
    """Return the text of the page."""
    parts = {
        "Notes of a scene": [(row.name, row.limits) for row in every_note()],
        "Warnings of an equilibrium": [(row.name, row.limits) for row in rows_of(GROUP, StateWarning)],
        "Checks of a run": [(row.name, row.limits) for row in CHECKS],
    }
    lines = [_HEAD]
    for title, rows in parts.items():
        lines += [f"## {title}", "", *table(rows), ""]
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    sys.stdout.write(page())
