"""The code of docs/fields.md runs, and the page names what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import eomgen.fields
import eomgen.sampling
from eomgen.products.fields.documents.document import DATA_KINDS, OPERATOR_KINDS
from eomgen.products.fields.documents.tables import Chains

PAGE = Path(__file__).parents[2] / "docs" / "fields.md"


@pytest.mark.long
def test_the_page_runs(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = PAGE.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (file,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    Path("counts.toml").write_text(file, encoding="utf-8")
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(code, str(PAGE), "exec"), names)
    samples = names["samples"]
    assert isinstance(samples, eomgen.fields.Samples)
    assert samples.acceptance > 0.5 and samples.r_hat < 1.5
    found = names["found"]
    assert isinstance(found, eomgen.sampling.FieldSamples) and not found.interrupted
    assert found.settings.method == "omf4" and found.calibration is not None
    assert abs(found.calibration[0]) < 0.2 and abs(found.calibration[1] - 1.0) < 0.2
    assert "(16, 16, 16)" in capsys.readouterr().out


def test_the_page_names_every_key_of_files() -> None:
    text = PAGE.read_text(encoding="utf-8")
    keys = {*OPERATOR_KINDS, *DATA_KINDS, *Chains.model_fields}
    assert {key for key in keys if f"`{key}`" not in text} == set()


def test_the_page_names_every_public_name() -> None:
    text = PAGE.read_text(encoding="utf-8")
    every = {*eomgen.fields.__all__, *eomgen.sampling.__all__}
    missing = {name for name in every if not re.search(rf"\b{name}\b", text)}
    of_other_rooms = {"follow", "at_settings"}
    assert missing <= {"OPERATORS", "LinearOperator", "Samples", "autocorrelation_time", "split_r_hat", *of_other_rooms}
