"""Live pages: the model in WebAssembly has the digits of Python's run, in node and without a page."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import eomgen
from eomgen.cli import commands
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
from eomgen.products.pages import live
from eomgen.products.pages.sliders import range_of
from eomgen.products.pages.web_module import texts_with_numbers
from eomgen.products.pictures.animation import packed
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import Cache
from tests.models.doubtful_scenes import UNRESOLVED, oscillator, stuck

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
MISSING = "these tests run pages in node, and it is not installed; try: apt-get install nodejs"
#: Scenes and ends of runs, s: loops, beams of both kinds, events, sampled controllers, rotations, a moving base, roads.
SCENES = {
    "four_bar": 2.0,
    "bouncing_ball": 3.0,
    "heavy_top/se3": 0.3,
    "double_pendulum_on_shaking_base": 1.0,
    "active_vehicle": 1.0,
    "spin_up_beam": 0.5,
    "spin_up_beam/exact": 0.1,
    "pi_servo/sampled": 1.0,
}


@cache
def run_of(name: str) -> tuple[Any, eomgen.Solution]:
    file = EXAMPLES / (f"{name}.toml" if "/" in name else f"{name}/scene.toml")
    model = eomgen.build(file, profile="reproducible")
    return model, model.simulate(SCENES[name])


def in_node(page: Path, end: float, *changes: str) -> dict[str, Any]:
    """Return what the motion of a page is at a time, by a program without a browser."""
    node = shutil.which("node") or shutil.which("nodejs")
    if node is None:
        pytest.fail(MISSING)
    command = [node, str(HERE / "run_page.mjs"), str(page), repr(end), *changes]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def numbers(texts: list[str]) -> np.ndarray:
    return np.array([float(text) for text in texts])


@pytest.mark.slow
@pytest.mark.long_except("four_bar")
@pytest.mark.parametrize("name", SCENES)
def test_the_last_state_has_the_digits_of_pythons_run(name: str, tmp_path: Path) -> None:
    model, solution = run_of(name)
    page = model.live(tmp_path / "page.html", solution=solution)
    assert page.stat().st_size < 1_000_000
    told = in_node(page, SCENES[name])
    assert (told["fault"], told["status"], told["seen"]) == ("", 0, 0)
    row = numbers(told["row"])
    expected = np.concatenate([[solution.t[-1]], solution.q[-1], solution.v[-1], solution.a[-1]])
    np.testing.assert_array_equal(row[: len(expected)], expected)
    outputs = [np.atleast_1d(values[-1]).ravel() for values in solution.outputs.values()]
    np.testing.assert_array_equal(numbers(told["outputs"]), np.concatenate([*outputs, []]))
    energy = [solution.energy[key][-1] for key in ("kinetic", "potential", "power", "base_power")]
    np.testing.assert_array_equal(numbers(told["energy"]), energy)
    poses = np.frombuffer(base64.b64decode(packed(solution, solution.poses_and_scenery)["poses"]), "<f4")
    last = poses.reshape(-1, len(told["poses"]))[-1]  # of what the picture draws
    np.testing.assert_allclose(numbers(told["poses"]), last, rtol=0.0, atol=2e-6)


@pytest.mark.slow
def test_a_changed_start_and_parameter_act_as_in_python_and_loops_stay_closed(tmp_path: Path) -> None:
    model, solution = run_of("four_bar")
    page = model.live(tmp_path / "page.html", solution=solution)
    data = page_data(page)
    (first,) = [item["name"] for item in data["sliders"] if item["kind"] == "position"][:1]
    told = in_node(page, 0.3, f"{first}=0.9")
    assert told["fault"] == "" and told["status"] == 0 and told["closed"]
    start = numbers(told["first"])[1 : 1 + model.nq]
    assert start[0] == 0.9 and np.max(np.abs(model.evaluate("constraint", start)["Phi"])) < 1e-12
    nearby = model.simulate(0.3, initial={first: 0.9})
    assert nearby.q[0][0] == pytest.approx(0.9, abs=0.2)  # Python moves all coordinates, the page holds the chosen one


def page_data(page: Path) -> Any:
    begin = '<script id="data" type="application/json">'
    text = page.read_text(encoding="utf-8")
    return json.loads(text[text.index(begin) + len(begin) :].partition("</script>")[0])["live"]


CART: dict[str, Any] = {
    "format": 1,
    "name": "caller",
    "bodies": {"cart": {"mass": 1}},
    "joints": {"x": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}},
    "inputs": {"push": {"unit": "N"}},
    "efforts": {"push": {"joint": "x", "effort": "push"}},
}
SAMPLED = {"type": "sampled", "sample": "10 ms", "signals": {"place": "q.x"}, "unit": "N"}


@pytest.mark.slow
def test_texts_of_a_page_have_the_numbers_of_the_library_and_give_its_bits(tmp_path: Path) -> None:
    model = eomgen.build(oscillator(), profile="quick")
    builder, texts = Builder("quick", cache=Cache(tmp_path)), texts_with_numbers(model.library)
    alone = builder.build(b"in the text", texts, INTERFACE_CDEF, model.library.layout)
    assert sorted(file.name for file in alone.folder.glob("*.bin")) == []
    assert alone.fingerprint == model.library.fingerprint
    random = np.random.default_rng(2)
    for function in model.library.layout["functions"]:
        inputs = [random.random(size) for size in function["input_sizes"]]
        results = []
        for library in (model.library, alone):
            outputs = [np.zeros(output["size"]) for output in function["outputs"]]
            library.call(function["name"], inputs, outputs)
            results.append(b"".join(output.tobytes() for output in outputs))
        assert results[0] == results[1], function["name"]


def test_a_page_has_no_functions_of_python(tmp_path: Path) -> None:
    efforts = {**CART["efforts"], "drive": {"joint": "x", "effort": "mine"}}
    model = eomgen.build({**CART, "controllers": {"mine": SAMPLED}, "efforts": efforts}, profile="quick")
    with pytest.raises(eomgen.ModelError) as caught:
        model.live(tmp_path / "page.html")
    assert str(caught.value) == (
        "model error: caller: a sampled controller calls a function of Python, and a page has none; try: the function"
        " in C, which a page compiles with the model, or eomgen animate for a recorded motion"
    )
    assert caught.value.exit_code == 4


def test_inputs_that_are_functions_are_refused_and_a_name_that_is_none_of_a_page(tmp_path: Path) -> None:
    model = eomgen.build(CART, profile="quick")
    solution = model.simulate(0.01, 1e-3, inputs={"push": lambda t: t})
    with pytest.raises(eomgen.UsageError) as caught:
        model.live(tmp_path / "page.html", solution=solution)
    assert str(caught.value) == (
        "usage error: input push: the input push of the run is a function, and a page has constant inputs and the"
        " scene's formulas; try: a formula or a curve of the scene for push, or a number"
    )
    with pytest.raises(eomgen.UsageError, match=r"cannot be saved as \.txt"):
        model.live(tmp_path / "page.txt")


def test_ranges_of_sliders_keep_the_requirements_and_the_value() -> None:
    assert range_of(2.0, "kg", lambda value: value > 0.0) == (0.5, 6.0)
    assert range_of(-2.0, "N", lambda value: value < -1.5) == (-6.0, -1.8)
    assert range_of(0.0, "m", lambda value: 0.0 <= value < 0.2) == (0.0, 0.1)
    assert range_of(0.5, "rad", lambda value: abs(value) < 1.0) == (-0.5, 0.8)
    assert range_of(3.0, "", lambda value: value == 3.0) == (3.0, 3.0)


@pytest.mark.long
def test_the_vehicle_steps_faster_than_real_time(tmp_path: Path) -> None:
    model, solution = run_of("active_vehicle")
    told = in_node(model.live(tmp_path / "page.html", solution=solution), SCENES["active_vehicle"])
    assert told["seconds"] < 0.5 * SCENES["active_vehicle"]  # the picture has the rest of the time of a frame


def test_the_help_of_live_shows_the_profile_that_pages_take() -> None:
    command = commands.get_command(click.Context(commands), "live")
    assert command is not None
    text = " ".join(command.get_help(click.Context(command)).split())
    assert "or in the least time. [default: reproducible]" in text


def test_pages_tell_the_error_of_an_internal_state() -> None:
    run = eomgen.build(oscillator(), profile="quick").simulate()
    assert run.error.worst is not None and run.error.worst.name.startswith("z.")
    assert f"of {run.error.worst.name} " in live._error(run)


def test_pages_tell_friction_that_steps_do_not_resolve() -> None:
    model = eomgen.build(stuck(), profile="quick")
    assert UNRESOLVED in live._note(model, model.simulate())
