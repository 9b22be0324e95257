"""A live page as a browser shows it: the digits of Python's run, sliders, single steps, settings in the address."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from benchmarks import frame_rates
from tests.browser.chromium import Browser, told_by, with_scripts

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def run_of(name: str, end: float) -> tuple[Any, eomgen.Solution]:
    model = eomgen.build(EXAMPLES / name / "scene.toml", profile="reproducible")
    return model, model.simulate(end)


def answer(browser: Browser, page: Path, script: str, place: str = "") -> Any:
    """Return the JSON that a script in the page, a file or a text, reports after the page is ready."""
    text = Path(__file__).with_name(script).read_text(encoding="utf-8") if script.endswith(".js") else script + REPORT
    copy = with_scripts(page, f"ready.then(() => {{ {text} }});")
    # time of the page goes on while the browser compiles WebAssembly, which takes seconds on a machine with other work
    for budget in (2_000, 20_000, 200_000):
        told = told_by(browser.document(copy, place, f"--virtual-time-budget={budget}"))
        assert browser.said == []
        if told is not None:
            break
    assert told is not None, "the script has reported no result"
    return told


REPORT = "document.body.dataset.told = JSON.stringify(told);"


@pytest.mark.long
def test_every_control_does_its_work(browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("bouncing_ball", 3.0)
    page = model.live(tmp_path / "ball.html", solution=solution)
    told = answer(browser, page, "live_controls.js", "p.shake=0.02&speed=2")
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


@pytest.mark.long
@pytest.mark.slow
def test_the_picture_follows_a_start_outside_of_it(browser: Browser, tmp_path: Path) -> None:
    scene = eomgen.load(EXAMPLES / "bouncing_ball" / "scene.toml")
    model = eomgen.build(scene, profile="reproducible")
    page = model.live(tmp_path / "ball.html", solution=model.simulate(0.05, initial={"height": 0.2}))
    told = answer(browser, page, "wide.js", "theme=light")
    assert told["top"] > 0.25 and told["inside"]
    assert max(new - old for new, old in zip(told["after"], told["before"], strict=True)) > 0.05


@pytest.mark.long_except("1280")
@pytest.mark.slow
@pytest.mark.parametrize("width", [500, 1280])
def test_no_text_of_a_plot_is_cut_and_every_curve_is_named(width: int, browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("four_bar", 1.0)
    page = model.live(tmp_path / "texts.html", solution=solution)
    told = answer(Browser(browser.command, width, 800), page, "texts.js")
    assert told["cut"] == []
    assert len(told["curves"]) > 8 and set(told["curves"]) <= set(told["names"])
    assert told["title"] == "four_bar"
    assert told["marks"] == [-40, -20, 0, 20, 40]  # one number alone gives no size
    assert "1.0 s" in told["names"] or "1 s" in told["names"]


@pytest.mark.slow
def test_a_chart_that_grew_looks_as_one_drawn_at_once(browser: Browser, tmp_path: Path) -> None:
    model, solution = run_of("four_bar", 1.0)
    page = model.live(tmp_path / "charts.html", solution=solution)
    told = answer(browser, page, "grown.js")
    assert len(told["charts"]) > 4
    for chart in told["charts"]:
        assert chart["inked"] > 1000 and chart["differ"] < 0.01 * chart["inked"]
        assert chart["within"]
        assert chart["places"] < chart["most"]
        np.testing.assert_allclose(np.diff(chart["x"]), solution.t[-1], rtol=1e-9)
        assert chart["x"][1] - 0.1 * solution.t[-1] <= told["end"] <= chart["x"][1] + 1e-9


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
    second, after = answer(browser, page, f"{clock} {frames} {late}")
    assert (second, after) == pytest.approx((1.0, 1.1), abs=1e-9)  # a late frame counts as 0.1 s
