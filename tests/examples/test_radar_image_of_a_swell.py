"""examples/radar_image_of_a_swell: what its README says of folds, caustics, spectra and specular points."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "radar_image_of_a_swell"


@pytest.fixture(scope="module")
def demo() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "demo.py"))


def rows(head: str) -> list[list[str]]:
    """Return the cells of a table of the README, by the first cell of its head."""
    lines = (FOLDER / "README.md").read_text().splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith(f"| {head} |")) + 2
    found = []
    for line in lines[first:]:
        if not line.startswith("|"):
            break
        found.append([cell.strip() for cell in line.strip("|").split("|")])
    return found


@pytest.mark.slow
def test_folds_and_caustics_are_those_of_the_closed_forms_and_of_the_page(demo: dict[str, Any]) -> None:
    table = rows("R/V")
    assert len(table) == 4
    for row, (name, direction) in zip(table, [(n, d) for n in demo["RADARS"] for d in (1, -1)], strict=True):
        radar = demo["RADARS"][name]
        counted, closed = demo["folds"](radar, direction, 150)
        assert counted == pytest.approx(closed, abs=0.002)
        assert float(row[1]) == pytest.approx(closed, abs=0.002)
        assert float(row[2]) == pytest.approx(closed, abs=5e-5)
        halved, critical = demo["caustics"](radar, direction)
        assert halved == pytest.approx(critical, rel=1e-6)
        assert row[3] == f"from {halved:.6f} m" and row[4] == f"{critical:.6f} m"


@pytest.mark.long
@pytest.mark.slow
def test_images_keep_their_intensity_and_lose_waves_beyond_the_cut_off(demo: dict[str, Any]) -> None:
    spectrum, text = demo["swell"](), (FOLDER / "README.md").read_text()
    length = demo["length_of"](spectrum)
    k = 2.0 * math.pi / length * np.arange(1, demo["NUMBERS"] + 1)
    for name, radar in demo["RADARS"].items():
        power, left, changed = demo["spectra"](radar, 150)
        assert changed[0] < 1e-3
        closed = radar.intensity_spectrum(spectrum, length, demo["NUMBERS"])
        for band in (slice(25, 50), slice(50, 100), slice(100, 160)):
            assert power[band].sum() == pytest.approx(closed[band].sum(), rel=0.08), name
        kept = demo["attenuation"](radar, k)
        assert np.nanmean(np.abs(left - kept)[25:]) < 0.03
        cutoff = radar.cutoff(spectrum)
        assert f"{cutoff:.0f} m" in text and f"{radar.velocity_deviation(spectrum):.3f} m/s" in text
        assert demo["attenuation"](radar, np.array([2.0 * math.pi / cutoff]))[0] == pytest.approx(0.14, abs=0.03)


@pytest.mark.slow
def test_specular_points_are_those_of_the_page(demo: dict[str, Any]) -> None:
    counted, closed = demo["specular"](40)
    for row, one, other in zip(rows("slope"), counted, closed, strict=True):
        assert (row[1], row[2]) == (f"{one:.2f}", f"{other:.2f}")
    assert counted[:2] == pytest.approx(closed[:2], rel=0.02)
