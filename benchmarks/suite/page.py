"""The page of benchmarks, its figures and the README's rows, made of what is stored.

    python -m benchmarks.suite.page [--check]

Numbers come from ``benchmarks/results``, words from the register of rows. ``--check`` says whether the texts are those
of the stored numbers, and writes nothing.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from benchmarks.suite.environments import ROOT
from benchmarks.suite.outcomes import MEASURED, RESULTS, Finding, Outcome, read
from benchmarks.suite.register import ROWS, Comparison, Row

PAGE, README = ROOT / "docs" / "benchmarks.md", ROOT / "README.md"
BEGIN, END = "<!-- benchmarks: made by python -m benchmarks.suite.page -->", "<!-- end of benchmarks -->"
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))

INTRODUCTION = (
    "# Benchmarks\n\n"
    "Made by `make bench`, which installs the peers below `.bench/`, runs every row of the"
    " [suite](../benchmarks/README.md#the-suite), and writes this page. All contestants of a row compute the same"
    " numbers: each is held against the row's reference before anything is timed, and what is off gets no time. Each"
    " contestant is a process of its own, with one thread on one core where a row says nothing else; they take turns,"
    " and a time is the median of the turns, in CPU time. Ratios are eomgen's time by the other's: below 1 eomgen is"
    " faster. Where a contestant may choose its settings (tolerance, step, method), it takes its own fastest that meet"
    " the error of the row.\n"
)


def shown(seconds: float) -> str:
    """Return a time with three digits and its unit."""
    for size, unit in UNITS:
        if abs(seconds) >= 0.9995 * size or unit == "ns":
            value = seconds / size
            return f"{value:.0f} {unit}" if value >= 99.95 else f"{value:.3g} {unit}"
    raise AssertionError


def ratio_shown(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 0.995 else f"{ratio:.3g}"


def ratio_of(finding: Finding | None, comparison: Comparison) -> float | None:
    """Return own time by the other's, None where one of them is not there."""
    if finding is None:
        return None
    own, other = finding.value(comparison.own), finding.value(comparison.peer)
    return own / other if own and other else None


def lost(ratio: float, comparison: Comparison) -> bool:
    """Return whether a goal, or parity where there is no goal, is missed."""
    return ratio > (comparison.target or 1.0)


def compared(rows: Iterable[Row]) -> Iterator[tuple[Row, Comparison]]:
    for row in rows:
        for comparison in row.comparisons:
            yield row, comparison


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Return a Markdown table; columns whose numbers are given are set right."""
    rule = ["---:" if column in right else "---" for column in range(len(header))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [header, rule, *rows])


def goals(found: Mapping[str, Finding], rows: Sequence[Row]) -> str:
    """Return the table of what was set as a goal."""
    lines = []
    for row, comparison in compared(rows):
        if comparison.target is None:
            continue
        finding = found.get(row.name)
        ratio = ratio_of(finding, comparison)
        verdict = "not measured" if ratio is None else "**lost**" if lost(ratio, comparison) else "met"
        times = [shown(value) if finding and (value := finding.value(name)) else "-" for name in _pair(comparison)]
        goal = ratio_shown(comparison.target)
        told = ratio_shown(ratio) if ratio is not None else "-"
        lines.append([row.work, _names(comparison), *times, told, goal, verdict])
    for row in rows:
        for goal in row.goals:
            seconds = found[row.name].value(goal.own) if row.name in found else None
            verdict = "not measured" if seconds is None else "**lost**" if seconds > goal.seconds else "met"
            told = shown(seconds) if seconds is not None else "-"
            lines.append([row.work, "", told, "-", "-", shown(goal.seconds), verdict])
    header = ["work", "eomgen against", "eomgen", "other", "ratio", "goal, at most", ""]
    return markdown(header, lines, right=(2, 3, 4, 5))


def _pair(comparison: Comparison) -> tuple[str, str]:
    return comparison.own, comparison.peer


def _names(comparison: Comparison) -> str:
    return comparison.peer if comparison.own == "eomgen" else f"{comparison.peer} ({comparison.own})"


def losses(found: Mapping[str, Finding], rows: Sequence[Row]) -> str:
    """Return what is lost, with what limits it, and which contestants have no number."""
    lines = []
    for row, comparison in compared(rows):
        ratio = ratio_of(found.get(row.name), comparison)
        if ratio is not None and lost(ratio, comparison):
            goal = f", goal {ratio_shown(comparison.target)}" if comparison.target else ""
            limit = comparison.limit or "what limits it has not been looked into"
            lines.append(f"- {row.work}, against {comparison.peer}: {ratio_shown(ratio)}{goal}. {_sentence(limit)}")
    for row in rows:
        for one in row.goals:
            seconds = found[row.name].value(one.own) if row.name in found else None
            if seconds is not None and seconds > one.seconds:
                limit = one.limit or "what limits it has not been looked into"
                lines.append(f"- {row.work}: {shown(seconds)}, goal {shown(one.seconds)}. {_sentence(limit)}")
    return "\n".join(lines) or "None."


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:].rstrip(".") + "."


def unmeasured(found: Mapping[str, Finding], rows: Sequence[Row]) -> str:
    """Return the rows and contestants that have no number, and why."""
    lines = []
    for row in rows:
        if row.name not in found:
            lines.append(f"- {row.work}: not run.")
            continue
        for one in found[row.name].outcomes:
            if one.state != MEASURED:
                lines.append(f"- {row.work}, {one.name}: {one.state}{_why(one)}")
    return "\n".join(lines) or "None."


def _why(one: Outcome) -> str:
    error = f", off by {one.error:.0e}" if one.error is not None else ""
    return f"{error}. {_sentence(one.note)}" if one.note else f"{error}."


def section(found: Mapping[str, Finding], rows: Sequence[Row]) -> str:
    """Return all rows of a section, contestant by contestant."""
    lines, notes = [], []
    for row in rows:
        finding = found.get(row.name)
        if finding is None:
            continue
        notes.append(f"- {_sentence(row.work)} Held against {row.check}.")
        work = f"{row.work}; a {row.per}"
        ordered = sorted(finding.outcomes, key=lambda one: (one.value is None, one.value or 0.0))
        for one in ordered:
            own = finding.value(_own_of(row, one.name))
            ratio = ratio_shown(own / one.value) if own and one.value and not one.name.startswith("eomgen") else ""
            time = f"{shown(one.value)} ±{50 * (one.spread or 0):.0f}%" if one.value is not None else one.state
            error = f"{one.error:.0e}" if one.error is not None else ""
            lines.append([work, one.name, time, ratio, error, one.note if one.state == MEASURED else ""])
            work = ""
    header = ["work", "by", "time", "eomgen by this", "error", "settings"]
    return "\n".join([markdown(header, lines, right=(2, 3, 4)), "", *notes])


def _own_of(row: Row, peer: str) -> str:
    return next((comparison.own for comparison in row.comparisons if comparison.peer == peer), "eomgen")


def machine_told(found: Mapping[str, Finding]) -> str:
    """Return the machines of the findings in a sentence, the latest first."""
    told: dict[str, dict[str, None]] = {}
    for finding in sorted(found.values(), key=lambda one: -float(one.machine["time"])):
        m = finding.machine
        loads = [one.machine["load"] for one in found.values() if one.machine["commit"] == m["commit"]]
        span = f"{min(loads):g} to {max(loads):g}" if all(load is not None for load in loads) else "unknown"
        processor = f"{m['processor']} ({m['family']}, {m['vectors'] or 'no wide vectors'}), {m['cores']} cores"
        programs = f"{m['system']}, gcc {m['compiler']}, Python {m['python']}"
        told.setdefault(f"{processor}, {programs}", {})[f"{m['date']} {m['commit']} (load {span})"] = None
    return "\n".join(f"- {text}; date and commit: {', '.join(measured)}" for text, measured in told.items())


def versions(found: Mapping[str, Finding]) -> str:
    """Return the packages of the contestants with their versions in a line."""
    packages = {pair for finding in found.values() for one in finding.outcomes for pair in one.versions.items()}
    return "Versions: " + ", ".join(f"{package} {version}" for package, version in sorted(packages)) + "."


def page(found: Mapping[str, Finding], rows: Sequence[Row] = ROWS) -> str:
    """Return the text of docs/benchmarks.md."""
    parts = [INTRODUCTION, "Measured on:\n", machine_told(found), "", versions(found), ""]
    parts += ["![Time of each peer by eomgen's, on a logarithmic scale](benchmarks_ratios.svg)", ""]
    parts += [
        "All measurements since the suite exists are in [history.csv](../benchmarks/history.csv):",
        "",
        "![Times of each row over the dates of measurement](benchmarks_history.svg)",
        "",
    ]
    parts += ["## Goals", "", goals(found, rows), "", "## Lost, and what limits it", "", losses(found, rows), ""]
    for name in dict.fromkeys(row.section for row in rows):
        own = [row for row in rows if row.section == name]
        if any(row.name in found for row in own):
            parts += [f"## {name}", "", section(found, own), ""]
    parts += ["## Without a number", "", unmeasured(found, rows), ""]
    return "\n".join(parts)


def readme_rows(found: Mapping[str, Finding], rows: Sequence[Row] = ROWS) -> str:
    """Return the README's table."""
    lines = []
    for row, comparison in compared(rows):
        ratio = ratio_of(found.get(row.name), comparison)
        if not comparison.readme or ratio is None:
            continue
        own, other = (found[row.name].value(name) for name in _pair(comparison))
        lines.append([row.work, shown(own or 0.0), f"{comparison.peer}: {shown(other or 0.0)}", ratio_shown(ratio)])
    return markdown(["work", "eomgen", "other", "ratio"], lines, right=(1, 3))


def with_rows(readme: str, text: str) -> str:
    """Return the README with the table between its marks. Raises ValueError where it has none."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{README} has no line {BEGIN!r}, or no {END!r} after it")
    return f"{before}{BEGIN}\n{text}\n{END}{after}"


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.suite.page", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--check", action="store_true", help="write nothing; 1 where a text is not that of the numbers")
    parser.add_argument("--folder", type=Path, default=RESULTS)
    chosen = parser.parse_args(words)
    found = read(chosen.folder)
    if not found:
        print(f"nothing is stored in {chosen.folder}: python -m benchmarks.suite", file=sys.stderr)
        return 1
    texts = {PAGE: page(found), README: with_rows(README.read_text(encoding="utf-8"), readme_rows(found))}
    stale = [file for file, text in texts.items() if not file.exists() or file.read_text(encoding="utf-8") != text]
    if chosen.check:
        print("\n".join(f"{file} is not that of the stored numbers" for file in stale) or "as stored")
        return 1 if stale else 0
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")
    print("\n".join(map(str, texts)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
