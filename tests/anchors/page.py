"""The page of verification: one row for each anchor case, from the register and the kept measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tests.anchors import KINDS, Anchor, anchors, sources
from tests.anchors.runs import DISAGREEMENT, Difference, Run, gaps, runs

INTRODUCTION = """# Verification: anchor cases

Each row compares eomgen with digits from elsewhere. This page is written by `python -m tests.anchors
docs/verification.md` from `tests/anchors/cases.toml`, from which the tests take the same digits, and from
`tests/anchors/measured.json`, the numbers that these tests compared last. A test fails if its number leaves the
reference, or the number on this page, by more than the tolerance of its row.

Differences are relative: of a vector to its largest component, of separate numbers to each of them. `≤ 1 digit` means
one unit in the last printed digit. The [commands](#commands) below run the test of a row and print both numbers.

Measured orders of all methods: [orders](orders.md). Errors that runs state for themselves: [accuracy](accuracy.md).
Extreme conditions: [extremes](extremes.md). Times of other programs: [benchmarks](benchmarks.md).
"""


def printed(number: float, text: str) -> str:
    """Return a number with the digits of a printed one, and one digit more, at most 15 in all."""
    mantissa, mark, _ = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    if mark:
        return f"{number:.{decimals + 1}e}"
    whole = len(mantissa.partition(".")[0].lstrip("-0"))
    return f"{number:.{max(0, min(decimals + 1, 15 - whole))}f}"


def lines_of(case: Anchor, numbers: Sequence[float]) -> list[str]:
    """Return lines for a terminal: reference, own number, and the relative difference of the case."""
    lines = [f"{case.name}: {case.case}, {case.quantity}"]
    lines += [f"  {text:>24} {printed(own, text):>24}" for text, own in zip(case.digits, numbers, strict=True)]
    return [*lines, f"  relative difference {case.difference(np.array(numbers)):.1e}"]


def command(case: Anchor) -> str:
    """Return the command that measures a case and prints the comparison."""
    return f"python -m tests.anchors --only {case.name}"


def row(case: Anchor, numbers: Sequence[float], source: int) -> str:
    """Return the row of a case, with the number of its source on the page."""
    own = "<br>".join(printed(number, text) for number, text in zip(numbers, case.digits, strict=True))
    bound = "≤ 1 digit" if case.tolerance is None else f"≤ {case.tolerance:.0e}"
    difference = f"{case.difference(np.array(numbers)):.1e}<br>{bound}"
    words = f"`{case.name}`<br>{case.case}: {case.quantity}; source {source}, *{case.kind}*"
    return f"| {' | '.join([words, '<br>'.join(case.digits), own, difference])} |"


RUNS = """
# Runs of other programs

A row runs a scene of `examples/verification`, written from the data of the machine, next to a run which the makers or
users of another program have published, and compares the motion, velocities, accelerations and reactions that its file
holds at the instants of `tests/anchors/runs*.toml`; differences are relative to the largest figure of a signal. If a
third solution exists (SciPy to 1e-12, from equations written for the machine), both programs are compared with it; else
eomgen with the program. Differences are the largest over the whole files (`python -m tests.anchors docs/verification.md
--external DIR`); the tests compare at the instants alone, within the tolerances. A program that is off by more than
1e-4 is off within its accuracy, or beyond the accuracy that its publisher states.
"""


def remark(row: Run | Anchor) -> str:
    """Return the note of a row, with the date and the reason of a changed reference."""
    return "; ".join(filter(None, (row.note, row.changed and f"reference changed {row.changed}")))


def verdict(run: Run, difference: Difference) -> str:
    """Return the judgement of a row: agreement, or the program that is off by the third solution."""
    if not run.third:
        words = "agree" if difference.eomgen <= DISAGREEMENT else f"differ within the accuracy of {run.program.name}"
        return ": ".join(filter(None, (words, remark(run))))
    found = ["**eomgen is off**"] if difference.eomgen > DISAGREEMENT else []
    if difference.program > DISAGREEMENT:
        stated = difference.program <= run.program.within
        found.append(f"{run.program.name} is off, within its accuracy" if stated else f"**{run.program.name} is off**")
    words = "; ".join(found) or "all three agree"
    return ": ".join(filter(None, (words, remark(run))))


def row_of_run(run: Run, difference: Difference, spread: str) -> str:
    """Return the row of a run."""
    own_error = f"{difference.program:.1e}" if run.third else "not known"
    bound = f"{difference.eomgen:.1e}<br>≤ {run.tolerance:.0e}"
    words = [f"`{run.name}`<br>{run.case}", run.program.name, bound, own_error, spread, verdict(run, difference)]
    return f"| {' | '.join(words)} |"


def runs_part(kept: Mapping[str, Sequence[float]]) -> list[str]:
    """Return the lines of the page on runs of other programs."""
    text, subject = (
        [RUNS, "<!-- runs -->\n\n| program | date | accuracy, as published | source |\n|---|---|---|---|"],
        "",
    )
    programs = {row.program.name: row.program for row in [*runs().values(), *gaps().values()]}
    text += [f"| {it.name} | {it.date} | {it.accuracy} | {it.source} |" for it in programs.values()]
    errors: dict[str, dict[str, float]] = {}
    for run in runs().values():
        if run.third:
            errors.setdefault(run.scene, {})[run.program.name] = kept[run.name][1]
    subjects = list(dict.fromkeys(run.subject for run in runs().values()))
    for run in sorted(runs().values(), key=lambda run: subjects.index(run.subject)):
        if run.subject != subject:
            subject = run.subject
            heads = "case | program | eomgen off by | program off by | spread of publishers | verdict"
            text.append(f"\n## {subject}\n\n| {heads} |\n|---|---|---:|---:|---:|---|")
        same = errors.get(run.scene, {}).values() if not run.quantity else ()
        spread = f"{min(same):.0e} to {max(same):.0e}" if len(same) > 1 else ""
        text.append(row_of_run(run, Difference(*kept[run.name]), spread))
    text.append("\n## Cases that eomgen cannot express\n\n| case | program | reason |\n|---|---|---|")
    text += [f"| {gap.case} | {gap.program.name} | {gap.reason} |" for gap in gaps().values()]
    return [*text, "\n<!-- end -->"]


def page(kept: Mapping[str, Sequence[float]], kept_runs: Mapping[str, Sequence[float]]) -> str:
    """Return the page in Markdown."""
    numbers = {key: number for number, key in enumerate(sources(), 1)}
    text, subject = [INTRODUCTION], ""
    for case in anchors().values():
        if case.subject != subject:
            subject = case.subject
            text.append(f"\n## {subject}\n\n| case | reference | eomgen | difference |")
            text.append("|---|---:|---:|---:|")
        text.append(row(case, kept[case.name], numbers[case.source]))
    text += runs_part(kept_runs)
    text.append("\n## Sources\n\nKinds of sources:\n")
    text += [f"- *{kind}*: {meaning}" for kind, meaning in KINDS.items()]
    text.append("\nThe numbers in the tables:\n")
    text += [f"{numbers[key]}. {source}" for key, source in sources().items()]
    text.append("\n## Commands\n")
    for case in anchors().values():
        note = f" {remark(case)}." if remark(case) else ""
        text.append(f"- `{command(case)}` runs `{case.test}`.{note}")
    return "\n".join(text) + "\n"
