"""The density field of examples/density_field: which integrator costs what, and where that turns."""

from __future__ import annotations

import dataclasses
import math
import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from eomgen.products.fields.documents.field_reading import load_fields
from eomgen.sampling import memory_of, sample
from tests.fields.density import optimised

__all__ = ["optimised"]

FOLDER = Path(__file__).parents[2] / "examples" / "density_field"


@pytest.fixture(scope="module")
def demo() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "demo.py"))


def test_the_page_says_the_memory_of_the_run() -> None:
    system = load_fields(FOLDER / "system" / "density_field.toml")
    said = re.search(r"on one core and at most (\d+) MiB", (FOLDER / "README.md").read_text(encoding="utf-8"))
    assert said and int(said[1]) == math.ceil(memory_of(system) / 2**20)


@pytest.mark.long
@pytest.mark.slow
def test_leapfrogs_are_cheaper_where_steps_are_bounded_by_stability(demo: dict[str, Any]) -> None:
    """One object in a cell with the mass of the prior: order 4 may take steps of 0.54 over the largest frequency for
    each gradient, leapfrogs of 2. The research dossier (B3) has a ratio of 2.05; with the mass of Fisher and 0.04
    objects 0.96 upside down (B2), and schemes of minimum norm at less than half of that."""
    problem = demo["problem_of"](16, 1.0)
    cost = {name: demo["cost"](problem, name, "prior", 24)["cost"] for name in ("leapfrog", "suzuki4")}
    assert 1.5 < cost["suzuki4"] / cost["leapfrog"] < 2.6
    problem = demo["problem_of"](16, 0.04)
    cost = {
        name: demo["cost"](problem, name, "fisher", 24)["cost"] for name in ("leapfrog", "suzuki4", "minimum_norm2")
    }
    assert 0.7 < cost["leapfrog"] / cost["suzuki4"] < 1.5
    assert cost["minimum_norm2"] < 0.5 * cost["leapfrog"]


@pytest.mark.long
@pytest.mark.slow
def test_the_field_is_found_where_objects_are() -> None:
    """The file on 32^3 cells of the same size: scales against the prototype of the dossier (B4), within its spread of
    one realisation, and calibration."""
    system = dataclasses.replace(load_fields(FOLDER / "system" / "density_field.toml"), cells=(32,) * 3,
                                 lengths=(156.25,) * 3)  # fmt: skip
    found = sample(system, samples=80, warm_up=20)
    assert found.calibration is not None
    assert abs(found.calibration[0]) < 0.02 and found.calibration[1] == pytest.approx(1.0, abs=0.03)
    prototype = (0.867, 0.615, 0.495, 0.365, 0.275, 0.226, 0.158, 0.128)
    for scale, correlation in zip(found.scales(), prototype, strict=True):
        assert scale.correlation == pytest.approx(correlation, abs=0.08)
        assert scale.mean == pytest.approx(scale.truth, rel=0.5) and scale.r_hat < 1.1
