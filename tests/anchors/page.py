"""The page of verification: one row for each anchor case, from the register and the kept measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tests.anchors import KINDS, Anchor, anchors, sources

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


def page(kept: Mapping[str, Sequence[float]]) -> str:
    """Return the page in Markdown."""
    numbers = {key: number for number, key in enumerate(sources(), 1)}
    text, subject = [INTRODUCTION], ""
    for case in anchors().values():
        if case.subject != subject:
            subject = case.subject
            text.append(f"\n## {subject}\n\n| case | reference | eomgen | difference |")
            text.append("|---|---:|---:|---:|")
        text.append(row(case, kept[case.name], numbers[case.source]))
    text.append("\n## Sources\n\nKinds of sources:\n")
    text += [f"- *{kind}*: {meaning}" for kind, meaning in KINDS.items()]
    text.append("\nThe numbers in the tables:\n")
    text += [f"{numbers[key]}. {source}" for key, source in sources().items()]
    text.append("\n## Commands\n")
    for case in anchors().values():
        note = f" {case.note}." if case.note else ""
        text.append(f"- `{command(case)}` runs `{case.test}`.{note}")
    return "\n".join(text) + "\n"
