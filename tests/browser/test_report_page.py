"""A report as a browser shows it: charts that are drawn and zoom together, and the animation within."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.browser.chromium import Browser
from tests.models.scenes import PENDULUM_TOML

ZOOM = """<script>
const told = { charts: charts.length };
const [first, second] = charts;
const pointer = (type, offsetX) => {
  const event = new PointerEvent(type, { pointerId: 1 });
  Object.defineProperty(event, "offsetX", { value: offsetX });
  first.canvas.dispatchEvent(event);
};
first.canvas.setPointerCapture = () => {};
told.before = second.shown.x;
const middle = (first.left + first.right) / 2;
pointer("pointerdown", first.left); pointer("pointermove", middle); pointer("pointerup", middle);
told.zoomed = [first.shown.x, second.shown.x];
first.canvas.dispatchEvent(new MouseEvent("dblclick"));
told.again = [first.shown.x, second.shown.x];
told.ready = document.documentElement.dataset.ready; told.error = document.documentElement.dataset.error || "";
document.body.dataset.told = JSON.stringify(told);
</script>"""


@pytest.mark.long
def test_charts_are_drawn_and_zoom_together(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    model = eomgen.build(tmp_path / "scene.toml", profile="quick")
    page = model.report(tmp_path / "report.html", model.simulate(0.5, 1e-2))
    copy = tmp_path / "zoomed.html"
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", ZOOM + "</body>"), encoding="utf-8")
    document = browser.document(copy)
    assert browser.said == []
    found = re.search(r'<body[^>]*\bdata-told="([^"]*)"', document)
    assert found
    told = json.loads(html.unescape(found[1]))
    assert told["ready"] == "yes" and told["error"] == "" and told["charts"] >= 3
    np.testing.assert_allclose(told["before"], [0.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(told["zoomed"], [[0.0, 0.25]] * 2, atol=1e-3)
    np.testing.assert_allclose(told["again"], [[0.0, 0.5]] * 2, atol=1e-6)
    picture = browser.picture(page)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


PAPER = """<script>
const told = { before: charts.map(({ canvas }) => canvas.width) };
window.dispatchEvent(new Event("beforeprint"));
told.printed = charts.map(({ canvas }) => [canvas.width, canvas.height]);
window.dispatchEvent(new Event("afterprint"));
told.after = charts.map(({ canvas }) => canvas.width);
told.names = charts.flatMap(({ series }) => series.curves.map(({ name }) => name));
document.body.dataset.told = JSON.stringify(told);
</script>"""


@pytest.mark.long
def test_charts_have_a_size_of_their_own_on_paper(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    model = eomgen.build(tmp_path / "scene.toml", profile="quick")
    page = model.report(tmp_path / "report.html", model.simulate(0.5, 1e-2))
    copy = tmp_path / "asked.html"
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", PAPER + "</body>"), encoding="utf-8")
    found = re.search(r'<body[^>]*\bdata-told="([^"]*)"', browser.document(copy))
    assert found
    told = json.loads(html.unescape(found[1]))
    assert told["after"] == told["before"] and set(map(tuple, told["printed"])) == {(1050, 600)}
    assert "kinetic" in told["names"] and not any(name.startswith(("output.", "energy.")) for name in told["names"])
    paper = tmp_path / "report.pdf"
    browser.document(page, "", f"--print-to-pdf={paper}", "--no-pdf-header-footer")
    content = paper.read_bytes()
    assert content.count(b"/Type /Page\n") in (3, 4, 5)
    assert content.startswith(b"%PDF")
