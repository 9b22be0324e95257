"""Chains of any length: what a step, the build and the compiled model cost, and how that grows with the number of
links."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.measure import figure, table

ROOT = Path(__file__).resolve().parent.parent
NOT_BUILT = "not built"


def length_run(coordinates: str, kind: str, links: int, seconds: float) -> dict[str, float] | str:
    """Return what a chain costs, from a process of its own, or why it did not get there."""
    command = [sys.executable, "-m", "benchmarks.chains", coordinates, kind, str(links)]
    try:
        result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return f"{NOT_BUILT} within {seconds:.0f} s"
    if result.returncode:
        return (result.stderr.strip().splitlines() or ["no message"])[-1]
    return dict(json.loads(result.stdout.splitlines()[-1]))


def exponent(sizes: Sequence[Mapping[str, float]], what: str) -> float:
    """Return the slope over the number of links, fitted in logarithms."""
    if len(sizes) < 2:
        return float("nan")
    return float(np.polyfit(np.log([s["links"] for s in sizes]), np.log([s[what] for s in sizes]), 1)[0])


def length_table(sizes: Sequence[Mapping[str, float]]) -> str:
    """Return sizes line by line, with the time of an iteration, and fitted exponents below."""
    lines = []
    for s in sizes:
        lines.append(
            [
                f"{s['links']:.0f}",
                f"{figure(s['microseconds'])} ±{50 * s['spread']:.0f}%",
                f"{s['newton_iterations']:.2f}",
                f"{s['factorizations']:.2f}",
                figure(s["microseconds"] / s["newton_iterations"]),
                figure(s["build_seconds"]),
                figure(s["megabytes"]),
                figure(s["compiler_megabytes"]),
            ]
        )
    per_iteration = [{**s, "iteration": s["microseconds"] / s["newton_iterations"]} for s in sizes]
    slopes = [exponent(per_iteration, what) for what in ("microseconds", "iteration", "build_seconds")]
    lines.append(["exponent", f"{slopes[0]:.2f}", "", "", f"{slopes[1]:.2f}", f"{slopes[2]:.2f}", "", ""])
    header = (
        "links",
        "us per step",
        "iterations",
        "factorizations",
        "us per iteration",
        "build, CPU s",
        "MB",
        "MB of gcc",
    )
    return table(header, lines)


def lengths(
    cases: Sequence[tuple[str, str]], links: Sequence[int], seconds: float
) -> tuple[list[str], dict[str, object]]:
    """Return texts and data of all chains; longer ones are not tried after one that took too long to build."""
    texts: list[str] = []
    data: dict[str, object] = {}
    for coordinates, kind in cases:
        sizes: list[dict[str, float]] = []
        stopped: list[str] = []
        for count in links:
            found = length_run(coordinates, kind, count, seconds)
            if isinstance(found, str):
                stopped.append(f"{count} links: {found}")
                if found.startswith(NOT_BUILT):
                    break
            else:
                sizes.append(found)
        name = f"{kind}s in {coordinates} coordinates"
        parts = [f"Chains of {name}", length_table(sizes) if sizes else "", *stopped]
        texts.append("\n\n".join(part for part in parts if part))
        data[name] = {"sizes": sizes, "stopped": stopped}
    return texts, data
