"""Published digits of geometrically exact beams at rest, by refinement: roll-up, bend of 45 degrees, two sections.

    python -m benchmarks.beam_anchors [--elements 2 4 8 16 32] [--json out.json]

The digits are those of Kynema-FMB's verification chapter (github.com/kynema/kynema-fmb, docs/sphinx/testing), 15 nodes
of one spectral element, which BeamDyn meets. An error is the distance of the tip from there, of the length of its
displacement; the last column is Richardson's extrapolation over all rows so far, whose errors are a series in squares
of the spacing. Kynema's bend of 45 degrees is a parabola through three points of the arc; of the arc itself the digits
are those of the differential equations (tests/oracles/rods.py).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

import eomgen
from benchmarks.measure import table
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from tests.anchors import anchor

Array = NDArray[np.float64]
STRAINS = ("torsion", "bending_z", "bending_y", "stretch", "shear_y", "shear_z")
ELEMENTS = (2, 4, 8, 16, 32)
#: Frames by which the parabola is given.
FRAMES = 64


@dataclass(frozen=True)
class Case:
    """A cantilever with a load at its tip.

    Attributes
    ----------
    beam : its keys but model, elements and inertia
    least : elements with which its rest is found under the whole load at once
    load : keys of the load, tip : where the unloaded tip is, displacement : published
    """

    beam: dict[str, Any]
    load: dict[str, Any]
    tip: Sequence[float]
    displacement: Sequence[float]
    least: int = 2
    joint: dict[str, Any] = field(default_factory=dict)


def matrix(diagonal: Sequence[float], coupling: Sequence[tuple[int, int, float]] = ()) -> list[list[float]]:
    rows = np.diag(np.array(diagonal, float))
    for i, j, value in coupling:
        rows[i, j] = rows[j, i] = value
    return [[float(value) for value in row] for row in rows]


def parabola() -> tuple[dict[str, Any], dict[str, Any], list[float]]:
    """Return keys of the shape of Kynema's bend, those of its clamp, and where its tip is."""
    points = np.array([[0.0, 0.0], [38.2683, -7.61205], [70.7107, -29.2893]])
    line = np.polynomial.Polynomial.fit(points[:, 0], points[:, 1], 2).convert()
    slope = line.deriv()

    def length(x: float) -> float:
        return float(quad(lambda place: math.hypot(1.0, slope(place)), 0.0, x, epsabs=1e-12, epsrel=1e-13)[0])

    end = float(points[2, 0])
    total, first = length(end), math.atan(slope(0.0))
    back = np.array([[math.cos(first), math.sin(first)], [-math.sin(first), math.cos(first)]])
    frames = []
    for k in range(FRAMES + 1):
        x = end * (k == FRAMES) or brentq(lambda x, k=k: length(x) - k / FRAMES * total, 0.0, end, xtol=1e-13)
        place = back @ [x, line(x)]
        turn = {"axis": [0, 0, 1], "angle": math.atan(slope(x)) - first}
        frames.append({"position": [*map(float, place), 0.0], "rotation": [turn]})
    frames[0] = {"position": [0.0, 0.0, 0.0]}
    return {"shape": {"frames": frames}}, {"rotation": [{"axis": [0, 0, 1], "angle": first}]}, [*points[2], 0.0]


def published(name: str) -> list[float]:
    """Return the displacement of an anchor case of the tests."""
    return [float(value) for value in anchor(name).reference]


def cases() -> dict[str, Case]:
    bend = {"stiffness_matrix": matrix([8.333e5] * 3 + [1e7, 41.6667e5, 41.6667e5])}
    shape, turned, end = parabola()
    rolled = dict.fromkeys(STRAINS, 500.0) | dict.fromkeys(STRAINS[3:], 1e4)
    composite = matrix(
        [16.96e3, 59.12e3, 141.47e3, 1368.17e3, 88.56e3, 38.78e3],
        [(0, 1, 17.61e3), (0, 2, -0.351e3), (1, 2, -0.37e3)],
    )
    twisted = matrix([1.41872656e8, 5.20833e8, 1.30208333e8, 2.5e10, 8.2604167e9, 8.2604167e9])
    eighth = [100.0 * math.sin(math.pi / 4.0), 100.0 * (math.cos(math.pi / 4.0) - 1.0), 0.0]
    up = {"force": [0, 0, "600 * load"]}
    return {
        "roll-up": Case(
            {"length": 10.0, "stiffness": rolled},
            {"torque": [0, f"{100.0 * math.pi!r} * load", 0]},
            [10.0, 0.0, 0.0],
            [-10.0, 0.0, 0.0],
            4,
        ),
        "bend, parabola": Case({**bend, **shape}, up, end, published("bend_of_45_degrees"), 4, joint=turned),
        "bend, arc": Case(
            {**bend, "length": 25.0 * math.pi, "curvature": [0, 0, -0.01]},
            up,
            eighth,
            [-23.56129679, 13.60502301, 53.47610814],
        ),
        "composite": Case(
            {"length": 10.0, "stiffness_matrix": composite},
            {"force": [0, 0, "150 * load"]},
            [10.0, 0.0, 0.0],
            published("composite_beam"),
        ),
        "twisted": Case(
            {"length": 10.0, "stiffness_matrix": twisted, "curvature": [math.pi / 20.0, 0, 0]},
            {"force": [0, 0, "-4e6 * load"]},
            [10.0, 0.0, 0.0],
            published("twisted_beam"),
        ),
    }


def displacement(case: Case, elements: int) -> Array:
    """Return the displacement of the tip at rest, (3,)."""
    beam = {"model": "cosserat", "elements": elements, "mass_per_length": 1.0, "rotary_inertia": [1.0, 1.0, 1.0]}
    scene: dict[str, Any] = {
        "format": 1,
        "name": "anchor",
        "gravity": [0, 0, 0],
        "parameters": {"load": {"value": 1.0, "tunable": True}},
        "beams": {"rod": {**beam, **case.beam}},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "rod", **case.joint}},
    }
    length = next(item.beam.length for item in eomgen.load(scene).elements if isinstance(item, CosseratBeam))
    end = [length, 0, 0]
    scene["forces"] = {"tip": {"body": "rod", "point": end, **case.load}}
    scene["points"] = {"tip": {"body": "rod", "position": end}}
    scene["outputs"] = {"tip": {"position": "tip"}}
    model = eomgen.build(scene)
    rest = model.equilibrium()
    return np.asarray(model.outputs(rest.q, rest.v)["tip"] - np.array(case.tip))


def extrapolated(found: Sequence[Array]) -> Array:
    """Return the limit of results whose spacing is halved from one to the next."""
    values, order = list(found), 2
    while len(values) > 1:
        values = [(2**order * fine - coarse) / (2**order - 1) for coarse, fine in pairwise(values)]
        order += 2
    return values[0]


@dataclass(frozen=True)
class Row:
    """One number of elements: displacement of the tip, its error and that of the extrapolation, of its size."""

    case: str
    elements: int
    displacement: list[float]
    error: float
    extrapolated: float


def rows_of(name: str, elements: Sequence[int] = ELEMENTS) -> list[Row]:
    """Return the rows of a case."""
    case, found, rows = cases()[name], [], []
    published = np.array(case.displacement)
    size = float(np.linalg.norm(published))
    for count in elements:
        if count >= case.least:
            found.append(displacement(case, count))
            errors = [float(np.linalg.norm(value - published)) / size for value in (found[-1], extrapolated(found))]
            rows.append(Row(name, count, found[-1].tolist(), *errors))
    return rows


def report(rows: Sequence[Row]) -> str:
    lines: list[list[str]] = []
    for before, row in zip([None, *rows[:-1]], rows, strict=True):
        known = before is not None and before.case == row.case and min(before.error, row.error) > 1e-12
        order = f"{math.log2(before.error / row.error):.2f}" if before is not None and known else "-"
        place = ", ".join(f"{value:.9g}" for value in row.displacement)
        lines.append([row.case, str(row.elements), place, f"{row.error:.1e}", order, f"{row.extrapolated:.1e}"])
    return table(["case", "elements", "displacement of the tip", "error", "order", "extrapolated"], lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, nargs="+", default=list(ELEMENTS), help="each twice the one before")
    parser.add_argument("--json", type=Path, help="write all rows to this file")
    arguments = parser.parse_args()
    rows = [row for name in cases() for row in rows_of(name, arguments.elements)]
    print(report(rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(row) for row in rows], indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
