"""A controller alone: the folder compiles without warnings, and gives the commands of the closed loop."""

from __future__ import annotations

import json
import platform
import re
import subprocess
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.target import Target
from eomgen.pipeline.generation import _check_only, _check_scene
from tests.models.lattice import Lattice
from tests.models.toml_text import toml_text

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-ffp-contract=off"]
SAMPLE = 0.002


def servo() -> dict[str, Any]:
    """Return nested data of an arm with an encoder, a difference for the rate, limits and computing time."""
    return {
        "format": 1,
        "name": "servo",
        "bodies": {"arm": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "center_of_mass": [0.3, 0, 0]}},
        "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
        "parameters": {
            "k": {"value": 40.0, "tunable": True, "unit": "N m/rad"},
            "d": {"value": 3.0, "tunable": True},
            "length": {"value": 0.5, "tunable": True},
        },
        "inputs": {"target": {"formula": "2 * sin(5 * t)", "unit": "rad"}},
        "points": {"tip": {"body": "arm", "position": ["length", 0, 0]}},
        "states": {
            "angle": {"sample": SAMPLE, "formula": "q.hinge", "quantum": 1e-5, "unit": "rad"},
            "before": {"sample": SAMPLE, "formula": "angle", "delay": SAMPLE},
            "torque": {
                "sample": SAMPLE,
                "formula": "min(5, max(-5, k * (target - angle) - d * (angle - before) / 0.002 + 0.1 * tanh(t)))",
                "delay": 0.001,
                "unit": "N m",
            },
        },
        "efforts": {"motor": {"joint": "hinge", "effort": "torque"}},
        "outputs": {"lean": {"formula": "q.hinge", "unit": "rad", "description": "by the encoder"}},
    }


def compiled(folder: Path, *flags: str) -> Path:
    """Return the program of a folder, compiled without a warning."""
    program = folder / "program"
    sources = sorted(file.name for file in folder.glob("*.c"))
    subprocess.run(["cc", *STRICT, *flags, *sources, "-o", program.name, "-lm"], cwd=folder, check=True)
    return program


def answers(program: Path, rows: Array, *arguments: str) -> Array:
    """Return time and commands of a program for rows of signals."""
    text = "".join(" ".join(f"{number:.17g}" for number in row) + "\n" for row in rows)
    ended = subprocess.run([program, *arguments], input=text, capture_output=True, text=True, check=True)
    return np.array([[float(number) for number in line.split(",")] for line in ended.stdout.splitlines()])


@pytest.mark.slow
def test_sampled_states_give_the_commands_of_the_closed_loop(tmp_path: Path) -> None:
    data, k = servo(), 25.0
    eomgen.generate(data, tmp_path / "c", only="controller", parameters={"k": k})
    terms = ["outputs", "samples", "forward_dynamics", "internal_rate"]
    model = eomgen.build(data, terms, method="rk4", profile="quick")
    run = model.simulate(0.3, 2.5e-4, method="rk4", parameters={"k": k})
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    names = [item["name"] for item in manifest["quantities"]["inputs"]]
    assert names == ["lean", "target"]
    assert [item["name"] for item in manifest["quantities"]["outputs"]] == ["torque"]
    assert [item["name"] for item in manifest["quantities"]["parameters"]] == ["k", "d"]  # not the plant's
    assert manifest["controller"] == {"tick": 0.001, "clocks": [[2, 0], [2, 1]]}
    calls = slice(0, -4, 4)  # each 1 ms
    signals = np.column_stack([run.outputs["lean"], run.inputs["target"]])[calls]
    held = answers(compiled(tmp_path / "c"), signals)
    after = run.z[1::4, -1]
    np.testing.assert_allclose(held[:, 0], run.t[calls], rtol=0, atol=1e-12)
    np.testing.assert_allclose(held[:, 1], after[: len(held)], rtol=1e-13, atol=1e-13)
    page = (tmp_path / "c" / "README.md").read_text(encoding="utf-8")
    listed = ", ".join(f"{time:.9g}" for time in held[:4, 0].round(9))
    assert f"one line for each call, that is at\n{listed}, ... s,\n" in page
    assert np.ptp(held[:, 1]) > 5.0 and np.max(np.abs(held[:, 1])) <= 5.0


@pytest.mark.slow
def test_continuous_controllers_give_commands_and_rates_of_the_scene(tmp_path: Path) -> None:
    data = servo()
    data["states"] = {"motor": {"rate": "(drive - motor) / 0.01", "unit": "N m"}}
    data["efforts"]["motor"]["effort"] = "motor"
    data["controllers"] = {
        "drive": {
            "type": "pid", "signal": "target - q.hinge", "proportional": "k", "integral": 20, "derivative": "d",
            "time_constant": 0.02, "minimum": -5, "maximum": 5, "unit": "N m",
        }
    }  # fmt: skip  # a table
    data["outputs"]["asked"] = {"formula": "drive"}
    eomgen.generate(data, tmp_path / "c", only="controller")
    step = 1e-3
    run = eomgen.build(data, profile="quick").simulate(0.5, step, method="rk4")
    rows = np.column_stack([run.t, run.outputs["lean"], run.inputs["target"]])
    program = compiled(tmp_path / "c")
    given = answers(program, rows)
    asked = run.outputs["asked"]
    assert given[0, 1] == pytest.approx(asked[0], rel=1e-13)  # the same states, so the same digits
    coarse = np.max(np.abs(given[:, 1] - asked))
    assert coarse < 1e-2
    fine = eomgen.build(data, profile="quick").simulate(0.5, step / 2, method="rk4")
    rows = np.column_stack([fine.t, fine.outputs["lean"], fine.inputs["target"]])
    assert np.max(np.abs(answers(program, rows)[:, 1] - fine.outputs["asked"])) < 0.4 * coarse


@pytest.mark.slow
def test_a_function_in_c_is_called_with_its_memory(tmp_path: Path) -> None:
    (tmp_path / "law.c").write_text(
        "int law(double t, const double *signals, double *values, double *memory)\n"
        "{ memory[0] += signals[0]; values[0] = -3.0 * signals[0] - 0.1 * memory[0] + 0.01 * t; return 0; }\n",
        encoding="utf-8",
    )
    data = servo()
    del data["states"]
    data["controllers"] = {
        "torque": {
            "type": "sampled", "sample": SAMPLE, "signals": {"off": "q.hinge - target"}, "source": "law.c",
            "function": "law", "memory": 1, "quantum": 1e-3,
        }
    }  # fmt: skip  # a table
    scene = tmp_path / "scene.toml"
    scene.write_text(toml_text(data), encoding="utf-8")
    assert main(["generate", str(scene), "--only", "controller", "--out", str(tmp_path / "c")]) == 0
    run = eomgen.build(scene, profile="quick").simulate(0.2, 1e-3, method="rk4")
    calls = slice(0, -2, 2)
    signals = np.column_stack([run.outputs["lean"], run.inputs["target"]])[calls]
    held = answers(compiled(tmp_path / "c"), signals)
    names = [state.name for state in eomgen.load(scene).states]
    after = run.z[1::2, names.index("torque_held")][: len(held)]
    np.testing.assert_allclose(held[:, 1], after, rtol=1e-13, atol=1e-13)


def test_floats_and_values_that_are_not_finite(tmp_path: Path) -> None:
    eomgen.generate(servo(), tmp_path / "c", only="controller", real="float")
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    assert " -DEOMGEN_REAL_FLOAT " in manifest["compile"]
    program = compiled(tmp_path / "c", "-DEOMGEN_REAL_FLOAT", "-Wshadow")
    held = answers(program, np.array([[0.1, 0.0], [0.1, 0.0], [0.1, 0.05]]), "k=10")
    np.testing.assert_allclose(held[:, 1], [0.0, -5.0, -5.0], rtol=1e-6)
    for text, code, told in (
        ("nan 0\n", 6, "line 1: status 1, see servo_controller.h"),
        ("0.1\n", 7, "input error: line 1 has fewer than 2 numbers"),
    ):
        ended = subprocess.run([program], input=text, capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stderr.strip()) == (code, told)
    for argument, told in (
        ("gain=1", "usage error: 'gain=1': no name=value with a tunable parameter; there are: k d"),
        ("k=two", "usage error: k: 'two' is not a finite number"),
    ):
        ended = subprocess.run([program, argument], input="", capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stderr.strip()) == (2, told)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names instructions of x86-64")
def test_limits_of_floats_have_no_doubles(tmp_path: Path) -> None:
    """Processors with floats alone compute doubles by library calls; the time of a step is kept in doubles."""
    eomgen.generate(servo(), tmp_path, only="controller", real="float")
    assert "`delay = 0` for them" in (tmp_path / "README.md").read_text(encoding="utf-8")
    flags = [*STRICT, "-DEOMGEN_REAL_FLOAT", "-Wdouble-promotion", "-Wfloat-conversion", "-S"]
    text = {}
    for file in ("servo_controller.c", "servo_controller_step.c"):
        subprocess.run(["cc", *flags, file, "-o", f"{file}.s"], cwd=tmp_path, check=True)
        text[file] = (tmp_path / f"{file}.s").read_text(encoding="utf-8")
        assert "cvtss2sd" not in text[file]
    assert not re.findall(r"\sv?(?:cvtsd2ss|(?:add|sub|mul|div|max|min|ucomi|comi)sd)\s", text["servo_controller.c"])
    assert "mulss" in text["servo_controller.c"]


def changed(**sections: Any) -> dict[str, Any]:
    """Return the servo with other sections."""
    return {**deepcopy(servo()), **sections}


def sampled(formula: str, **more: Any) -> dict[str, Any]:
    """Return sections of the servo with one sampled state."""
    return {"torque": {"sample": SAMPLE, "formula": formula, **more}}


MISTAKES: list[tuple[dict[str, Any], str]] = [
    (
        changed(states={}, efforts={}),
        "servo: the scene has no controller: neither sampled states nor [controllers]; try: sample and formula of a"
        " state, or with_controller(scene, law) of a design",
    ),
    (
        changed(states={"torque": {"rate": "q.hinge - torque"}}),
        "the scene has no controller: neither sampled states nor [controllers]",
    ),
    (
        changed(states=sampled("-gravity.hinge")),
        "gravity.hinge is inverse dynamics, which follows from the equations of the plant; try: an input in its place,"
        " fed by the C of the whole scene; or a controller without gravity.hinge",
    ),
    (
        changed(states=sampled("-0.01 * energy.total")),
        "energy.total is an energy of the machine, which follows from the equations of the plant; try: an input",
    ),
    (
        changed(events={"hit": {"when": "q.hinge - 1", "action": "reset", "reset": {"torque": 0.0}}}),
        "the event hit resets the state torque, and the controller has no events; try: a formula of the sampled state",
    ),
    (
        changed(
            states={}, controllers={"torque": {"type": "sampled", "sample": SAMPLE, "signals": {"angle": "q.hinge"}}}
        ),
        "controllers.torque: the function of this sampled controller is the caller's, so there is no C of it; try:"
        ' source = "controller.c", and the name of the function',
    ),
    (
        changed(
            states=sampled("-q.hinge") | {"slow": {"sample": 1.0000001e4, "formula": "torque", "delay": 1.1234567}}
        ),
        "have no common divisor that a counter of 32 bits can count; try: periods and delays that are whole multiples",
    ),
    (
        changed(
            states=sampled("-q.hinge * mode_gear"),
            modes={"gear": {"value": 1}},
            events={"over": {"when": "q.hinge - 1", "action": "switch", "mode": "gear", "to": 2}},
        ),
        "the mode gear is switched by events, and the controller has no events",
    ),
]


@pytest.mark.parametrize(("data", "text"), MISTAKES)
def test_scenes_without_a_controller_of_their_own_are_refused(data: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(eomgen.ModelError) as caught:
        eomgen.generate(data, tmp_path / "c", only="controller")
    assert text in str(caught.value) and not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"only": "plant"}, "only: no part of a scene is called 'plant'; try: controller"),
        (
            {"only": "controller", "method": "rk4"},
            "method: method belongs to the whole machine, and only the controller is generated",
        ),
        (
            {"only": "controller", "terms": ["mass"]},
            "terms: terms belongs to the whole machine, and only the controller is generated",
        ),
    ],
)
def test_calls_that_a_controller_cannot_have_are_refused(arguments: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        eomgen.generate(servo(), tmp_path / "c", **arguments)
    assert text in str(caught.value) and not (tmp_path / "c").exists()


def test_other_documents_and_languages_are_refused() -> None:
    lattice = Lattice("pair", "fput", (0.1, 0.2))
    told = "only: pair is not a mechanical scene, and only scenes have a controller; try: leave it out"
    with pytest.raises(eomgen.UsageError, match=told):
        _check_scene(lattice, "controller")
    told = "only: a controller alone is written in C, not in Python; try: target c"
    with pytest.raises(eomgen.UsageError, match=told):
        _check_only("controller", Target("python", "Python", NAMES, lambda program: {}))
