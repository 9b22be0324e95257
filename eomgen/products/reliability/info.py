"""Output of ``eomgen info`` for the random processes of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from eomgen.cli.info_part import InfoPart
from eomgen.cli.printing import console
from eomgen.cli.tables import print_table

if TYPE_CHECKING:
    from eomgen.system.signals import Input


def described_processes(inputs: Sequence[Input]) -> list[dict[str, Any]]:
    """Return the random processes among inputs: their modes, and the part of the variance that these capture."""
    return [
        {
            "name": item.name,
            "type": process.kind,
            "window": list(process.window),
            "over": "distance" if process.speed else "time",
            "seed": process.seed,
            "follows": process.follows,
            "correlation": dict(process.correlation),
            "coherent_with": list(process.coherent_with),
            "standard_deviation": process.standard_deviation,
            "variables": list(process.variables),
            "eigenvalues": list(process.eigenvalues),
            "captured": list(process.captured),
        }
        for item in inputs
        if (process := item.random) is not None
    ]


def print_processes(processes: list[dict[str, Any]]) -> None:
    """Print a table of random processes, and how much of the variance the first modes of each capture."""
    if not processes:
        return
    out = console()
    out.print()
    rows = [
        (
            item["name"],
            _kind(item),
            f"{item['window'][0]:.6g} to {item['window'][1]:.6g} {'m' if item['over'] == 'distance' else 's'}",
            f"{item['standard_deviation']:.6g}",
            _runs(item["variables"]),
            f"{100.0 * item['captured'][-1]:.6g} %",
        )
        for item in processes
    ]
    header = ("name", "type", "window", "standard deviation", "variables", "variance captured")
    print_table("Random processes", header, rows, numeric=(3, 5))
    for item in processes:
        if item["follows"] or item["correlation"] or item["coherent_with"]:
            continue
        count = len(item["captured"])
        shown = sorted({1, 2, 3, *(count * k // 8 for k in range(1, 8)), count} & set(range(1, count + 1)))
        parts = ", ".join(f"{k}: {100.0 * item['captured'][k - 1]:.4g} %" for k in shown)
        out.print(f"Variance of {item['name']} in its first modes, {parts}", markup=False)


def _kind(item: dict[str, Any]) -> str:
    """Return a description of a random process in words."""
    if item["follows"]:
        return f"follows {item['follows']}"
    if item["coherent_with"]:
        return f"coherent with {', '.join(item['coherent_with'])}"
    others = ", ".join(f"{value:.6g} with {name}" for name, value in item["correlation"].items())
    return f"correlated, {others}" if others else str(item["type"])


def _runs(variables: list[str]) -> str:
    """Return ``force_z1 to force_z21`` for the variables of each process among them."""
    runs = [list(names) for _, names in groupby(variables, key=lambda name: name.rstrip("0123456789"))]
    return ", ".join(f"{names[0]} to {names[-1]}" if len(names) > 1 else names[0] for names in runs)


PROCESSES = InfoPart(
    lambda scene: {"random": described_processes(scene.inputs)},
    lambda data: print_processes(data["random"]),
    lambda data: (name for item in data["random"] for name in item["variables"]),
)
