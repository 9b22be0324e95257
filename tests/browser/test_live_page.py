"""A live page as a browser shows it: the digits of Python's run, sliders, single steps, settings in the address."""

from __future__ import annotations

import html
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from benchmarks import frame_rates
from tests.browser.chromium import Browser

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def run_of(name: str, end: float) -> tuple[Any, eomgen.Solution]:
    model = eomgen.build(EXAMPLES / name / "scene.toml", profile="reproducible")
    return model, model.simulate(end)


def answer(browser: Browser, page: Path, script: str, place: str = "") -> Any:
    """Return the JSON that a script in the page reports, after the page is ready."""
    waiting = f"<script>ready.then(() => {{ {script} }});</script></body>"
    copy = page.with_name(f"asked_{page.name}")
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", waiting), encoding="utf-8")
    # time of the page goes on while the browser compiles WebAssembly, which takes seconds on a machine with other work
    for budget in (2_000, 20_000, 200_000):
        document = browser.document(copy, place, f"--virtual-time-budget={budget}")
        assert browser.said == []
        told = re.search(r'<body[^>]*\bdata-told="([^"]*)"', document)
        if told:
            break
    assert told, "the script has reported no result"
    return json.loads(html.unescape(told[1]))


REPORT = "document.body.dataset.told = JSON.stringify(told);"


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("name", "end"), [("bouncing_ball", 3.0), ("four_bar", 1.0), ("active_vehicle", 0.5)])
def test_the_last_state_has_the_digits_of_pythons_run(name: str, end: float, browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of(name, end)
    page = model.live(tmp_path / f"{name}.html", solution=solution)
    told = answer(browser, page, f"const told = runTo({end}); {REPORT}", "theme=light")
    expected = np.concatenate([[solution.t[-1]], solution.q[-1], solution.v[-1], solution.a[-1]])
    assert (told["status"], told["fault"]) == (0, "")
    np.testing.assert_array_equal([float(text) for text in told["row"][: len(expected)]], expected)
    assert float(told["energy"][0]) == solution.energy["kinetic"][-1]


CONTROLS = """
const told = {};
play(false);
restart();
single(); told.step = end;
const slider = (name, kind) => sliders.find((item) => item.name === name && item.kind === kind);
const ball = slider("restitution", "parameter");
told.low = ball.low; told.high = ball.high;
choose(ball, 0.5);
told.parameter = motion.blocks.parameters[0]; told.kept = end; told.hash = location.hash;
choose(slider("height", "position"), 0.85);
told.start = [end, motion.q[1]];
advance(0.5, 1e9); state.time = end; show();
told.moved = motion.q[1]; told.frames = count; told.events = happened.length;
choose(ball, 99); told.limited = ball.now;
byId("defaults").click(); told.again = [end, motion.q[1], location.hash];
play(true); told.playing = state.playing; tick(1000); tick(1050); told.played = state.time; play(false);
seek(0.01); told.sought = state.time;
hasten(-1); told.speed = byId("speed").value;
told.unnamed = [...document.querySelectorAll("button, input, select")].filter((item) =>
  !(item.getAttribute("aria-label") || item.textContent.trim() || (item.labels && item.labels.length))).length;
told.error = byId("error").textContent;
told.warning = byId("warning").hidden;
"""


@pytest.mark.long
def test_every_control_does_its_work(browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("bouncing_ball", 3.0)
    page = model.live(tmp_path / "ball.html", solution=solution)
    told = answer(browser, page, CONTROLS + REPORT, "p.shake=0.02&speed=2")
    assert told["step"] == solution.metadata["step"]
    assert told["low"] < 0.8 < told["high"]
    assert told["parameter"] == 0.5 and told["kept"] == told["step"]
    assert "p.restitution=0.5" in told["hash"] and "p.shake=0.02" in told["hash"] and "speed=2" in told["hash"]
    assert told["start"] == [0.0, 0.85]
    fallen = eomgen.build(EXAMPLES / "bouncing_ball" / "scene.toml", profile="reproducible").simulate(
        0.5, parameters={"restitution": 0.5, "shake": 0.02}, initial={"height": 0.85}
    )
    assert told["moved"] == fallen.q[-1][1] and told["events"] == len(fallen.events.t)
    assert told["limited"] == told["high"]
    assert told["again"] == [0.0, 0.6, "#speed=2"]
    assert told["playing"] and 0.0 < told["played"] <= 0.11 and told["sought"] == 0.01
    assert told["speed"] == "1" and told["unnamed"] == 0 and told["warning"]
    assert told["error"].startswith("Estimated error of the run with the scene's values, to t = 3 s: ")


WIDE = """
play(false);
restart();
const told = { before: [...bounds.high] };
const height = sliders.find((item) => item.name === "height" && item.kind === "position");
for (let k = 0; k < 5; k++) choose(height, height.high);
const inside = ([x, y]) => x >= 0 && x <= camera.width && y >= 0 && y <= camera.height;
told.after = [...bounds.high];
told.inside = placesAt(count - 1).every((place) => inside(camera.project(place)));
told.top = motion.q[1];
"""


@pytest.mark.long
@pytest.mark.slow
def test_the_picture_follows_a_start_outside_of_it(browser: Browser, tmp_path: Path) -> None:
    scene = eomgen.load(EXAMPLES / "bouncing_ball" / "scene.toml")
    model = eomgen.build(scene, profile="reproducible")
    page = model.live(tmp_path / "ball.html", solution=model.simulate(0.05, initial={"height": 0.2}))
    told = answer(browser, page, WIDE + REPORT, "theme=light")
    assert told["top"] > 0.25 and told["inside"]
    assert max(new - old for new, old in zip(told["after"], told["before"], strict=True)) > 0.05


TEXTS = """
const told = { names: [], cut: [], title: byId("title").textContent };
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const width = this.measureText(text).width;
  const first = x - { left: 0, start: 0, center: width / 2, right: width }[this.textAlign];
  const { canvas } = this;
  told.names.push(text);
  if (first < 0 || first + width > canvas.width || y < 0 || y > canvas.height) told.cut.push([text, first, y]);
  fill.call(this, text, x, y);
};
play(false);
restart();
advance(1, 1e9);
drawCharts();
told.curves = live.plots.flatMap(({ curves }) => curves.map(({ name }) => name));
told.marks = ticksOf(-45, 45, 2.6).ticks;
"""


@pytest.mark.long_except("1280")
@pytest.mark.slow
@pytest.mark.parametrize("width", [500, 1280])
def test_no_text_of_a_plot_is_cut_and_every_curve_is_named(width: int, browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("four_bar", 1.0)
    page = model.live(tmp_path / "texts.html", solution=solution)
    told = answer(Browser(browser.command, width, 800), page, TEXTS + REPORT)
    assert told["cut"] == []
    assert len(told["curves"]) > 8 and set(told["curves"]) <= set(told["names"])
    assert told["title"] == "four_bar"
    assert told["marks"] == [-40, -20, 0, 20, 40]  # one number alone gives no size
    assert "1.0 s" in told["names"] or "1 s" in told["names"]


GROWN = """
const told = { charts: [] };
play(false);
restart();
const pixels = ({ canvas: { width, height }, canvas }) => {
  const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  return copy.getImageData(0, 0, width, height).data;
};
for (let k = 0; k < 150; k++) {
  state.time = advance(state.time + 1 / 60, 1e9);
  show();
}
let places = 0;
const go = CanvasRenderingContext2D.prototype.lineTo;
CanvasRenderingContext2D.prototype.lineTo = function (x, y) { places += 1; go.call(this, x, y); };
for (const { chart, plot, first } of charts) {
  const grown = pixels(chart);
  chart.key = "";
  places = 0;
  drawCharts();
  const anew = pixels(chart);
  let [differ, inked] = [0, 0];
  for (let k = 0; k < anew.length; k += 4) {
    inked += anew[k + 3] > 0;
    differ += [0, 1, 2, 3].some((j) => Math.abs(anew[k + j] - grown[k + j]) > 64);
  }
  const seen = plot.curves.flatMap((_, j) => [...values[first + j].subarray(frameAt(chart.shown.x[0])[0] + 1, count)]);
  const [low, high] = chart.shown.y;
  told.charts.push({ differ, inked, places, most: 4 * plot.curves.length * chart.width + 100,
    within: seen.every((y) => y > low && y < high), x: chart.shown.x, stored: count, curves: plot.curves.length });
}
told.end = end;
"""


@pytest.mark.slow
def test_a_chart_that_grew_looks_as_one_drawn_at_once(browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("four_bar", 1.0)
    page = model.live(tmp_path / "charts.html", solution=solution)
    told = answer(browser, page, GROWN + REPORT)
    assert len(told["charts"]) > 4
    for chart in told["charts"]:
        assert chart["inked"] > 1000 and chart["differ"] < 0.01 * chart["inked"]
        assert chart["within"]
        assert chart["places"] < chart["most"]
        np.testing.assert_allclose(np.diff(chart["x"]), solution.t[-1], rtol=1e-9)
        assert chart["x"][1] - 0.1 * solution.t[-1] <= told["end"] <= chart["x"][1] + 1e-9


@pytest.mark.slow
def test_charts_of_a_run_without_a_step_are_a_second_long(browser: Browser, tmp_path: Path) -> None:
    model, _ = run_of("bouncing_ball", 3.0)
    page = model.live(tmp_path / "still.html", solution=model.simulate(0.0))
    script = "play(false); drawCharts(); const told = charts.map(({ chart }) => chart.shown.x);"
    assert answer(browser, page, script + REPORT) == [[0, 1], [0, 1]]


@pytest.mark.slow
def test_a_page_that_plays_keeps_the_time_of_its_model(browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("bouncing_ball", 3.0)
    page = model.live(tmp_path / "ball.html", solution=solution)
    counted = frame_rates.count(page, 1.0, browser.command)
    assert counted.seconds >= 1.0 and 1.0 <= counted.frames <= 61.0 * counted.seconds
    assert 0.0 < counted.model < counted.seconds + 0.2  # behind, if other work of the machine takes frames
    clock = "performance.now = () => 0; const told = []; play(true); tick(1000);"
    frames = "for (let k = 1; k <= 60; k++) tick(1000 + 1000 * k / 60); told.push(state.time);"
    late = "tick(9000); told.push(state.time); play(false);"  # frames of the browser find a still page
    second, after = answer(browser, page, f"{clock} {frames} {late} {REPORT}")
    assert (second, after) == pytest.approx((1.0, 1.1), abs=1e-9)  # a late frame counts as 0.1 s


@pytest.mark.slow
def test_a_page_that_does_not_play_is_named(browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_rates, "PATIENCE", 1.0)
    page = tmp_path / "empty.html"
    page.write_text("<body></body>", encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"^empty\.html does not start to play$"):
        frame_rates.count(page, 0.1, browser.command)
