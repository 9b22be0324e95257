"""A report as a browser shows it: charts that are drawn and zoom together, and the animation within."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.browser.chromium import Browser, told_by, with_scripts
from tests.models.scenes import PENDULUM_TOML


@cache
def model() -> eomgen.Model:
    return eomgen.build(tomllib.loads(PENDULUM_TOML), profile="quick")


@pytest.mark.long
def test_charts_are_drawn_and_zoom_together(browser: Browser, tmp_path: Path) -> None:
    page = model().report(tmp_path / "report.html", model().simulate(0.5, 1e-2))
    told = told_by(browser.document(with_scripts(page, "zoom.js")))
    assert browser.said == []
    assert told["ready"] == "yes" and told["error"] == "" and told["charts"] >= 3
    np.testing.assert_allclose(told["before"], [0.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(told["zoomed"], [[0.0, 0.25]] * 2, atol=1e-3)
    np.testing.assert_allclose(told["again"], [[0.0, 0.5]] * 2, atol=1e-6)
    picture = browser.picture(page)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


@pytest.mark.long
def test_charts_have_a_size_of_their_own_on_paper(browser: Browser, tmp_path: Path) -> None:
    page = model().report(tmp_path / "report.html", model().simulate(0.5, 1e-2))
    told = told_by(browser.document(with_scripts(page, "paper.js")))
    assert told["after"] == told["before"] and set(map(tuple, told["printed"])) == {(1050, 600)}
    assert "kinetic" in told["names"] and not any(name.startswith(("output.", "energy.")) for name in told["names"])
    paper = tmp_path / "report.pdf"
    browser.document(page, "", f"--print-to-pdf={paper}", "--no-pdf-header-footer")
    content = paper.read_bytes()
    assert content.count(b"/Type /Page\n") in (3, 4, 5)
    assert content.startswith(b"%PDF")
