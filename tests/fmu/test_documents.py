"""The page in an FMU, and the recipes of the documentation."""

from __future__ import annotations

import re
from pathlib import Path

import fmpy
import numpy as np
import pytest

from eomgen.products.fmu.export import fmu_files
from tests.fmu.test_calls import ranged_ball
from tests.models.library import scene

ROOT = Path(__file__).parents[2]


def page_of(data: object, **options: object) -> str:
    files = fmu_files(data, binary=False, reference=False, **options).files  # type: ignore[arg-type]
    return str(files["documentation/index.html"])


def cells(page: str, name: str) -> list[str]:
    """Return the cells of the row of a variable."""
    rows = [re.findall(r"(?s)<td>\s*(.*?)\s*</td>", row) for row in re.findall(r"(?s)<tr>(.*?)</tr>", page)]
    return next([" ".join(cell.split()) for cell in row] for row in rows if row and row[0] == name)


def test_the_page_has_a_table_of_variables() -> None:
    page = page_of(ranged_ball(), version=2)
    assert cells(page, "mass")[2:6] == ["parameter", "kg", "0.2", "0 to \N{HORIZONTAL ELLIPSIS}"]
    assert cells(page, "bounce")[5] == "0 to 1" and cells(page, "height")[2:4] == ["output", "m"]
    assert cells(page, "push")[2:5] == ["input", "N", "0"]
    assert "Model exchange with 2 states and 1 event\nindicator." in page and "FMI 2.0: model exchange" in page
    assert "licence</dt><dd>not stated" in page and "Fixed parameters" not in page
    weight = {"value": 0.25, "unit": "kg", "description": "of <one>"}
    fixed = scene("balls", parameters={"weight": weight}, bodies__one__mass="weight")
    assert cells(page_of(fixed), "weight") == ["weight", "0.25", "kg", "of &lt;one&gt;"]


@pytest.mark.slow
def test_multipliers_and_drifts_have_units() -> None:
    page = page_of(ROOT / "examples" / "four_bar" / "scene.toml", dae=True)
    names = ("algebraic[3]", "residual[2]", "residual[3]", "drift[0]", "drift[2]")
    assert [cells(page, f"dae.{name}")[3] for name in names] == ["N", "N m", "m/s^2", "m", "m/s"]
    for sentence in ("There are 2 constraint equations", "(index 1)", "the log (logStatusWarning) has each value"):
        assert sentence in page


@pytest.mark.long
@pytest.mark.slow
def test_the_recipe_for_fmpy_runs(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "fmu.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"(?s)```python\n(import eomgen\nfrom fmpy.*?)```", text)
    code = code.replace("examples/", f"{(ROOT / 'examples').as_posix()}/").replace("out/", f"{tmp_path.as_posix()}/")
    names: dict[str, object] = {}
    exec(code, names)
    stepped, exchanged = names["stepped"], names["exchanged"]
    assert isinstance(stepped, np.ndarray) and isinstance(exchanged, np.ndarray)
    assert stepped["time"][-1] == 2.0 and np.ptp(stepped["tyre_load"]) > 100.0
    assert abs(stepped["body_acceleration"][-1] - exchanged["body_acceleration"][-1]) < 1e-3
    assert fmpy.read_model_description(str(names["file"])).modelName == "quarter_car"
