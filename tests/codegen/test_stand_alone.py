"""The program of an emitted folder: parameters and inputs by name, zero where the scene says nothing, as ``simulate``
does it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.folder import write_folder
from eomgen.codegen.targets.c.naming import c_string
from eomgen.codegen.targets.c.target import generate_files
from eomgen.integrators.families.register import method_named, method_names
from tests.codegen.hand_made import pendulum
from tests.codegen.test_render import HOSTILE, STRICT, hostile


def cart(*, formula: bool = True) -> eomgen.Scene:
    builder = eomgen.SceneBuilder("cart").parameter("drag", 0.3, tunable=True, unit="N s/m")
    builder.input("push", "2 * cos(3 * t)" if formula else None, unit="N").input("tilt")
    builder.body("cart", 2.0).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"velocity": 0.2})
    return builder.effort("motor", "rail", "push - 3 * tilt - drag * v.rail").build()


def compiled(folder: Path) -> Path:
    sources = sorted(str(path) for path in folder.glob("*.c"))
    command = [shutil.which("cc") or "gcc", *STRICT, *sources, "-o", str(folder / "program"), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "program"


def run(program: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(program), *words], check=False, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "formula"), [("generalized_alpha", True), ("rk4", False), ("taylor", True), ("rosenbrock", False)]
)
def test_program_runs_as_simulate_does(method: str, formula: bool, tmp_path: Path) -> None:
    scene = cart(formula=formula)
    eomgen.generate(scene, tmp_path / "c", method=method)
    program = compiled(tmp_path / "c")
    model = eomgen.build(scene, method=method, profile="reproducible")
    for words, options in (
        ((), {}),
        (("tilt=0.25",), {"inputs": {"tilt": 0.25}}),
        (("push=-1.5", "drag=0.9"), {"inputs": {"push": -1.5}, "parameters": {"drag": 0.9}}),
    ):
        result = run(program, "0.5", *words, "0.01", "50")
        assert (result.returncode, result.stderr) == (0, "")
        last = [float(text) for text in result.stdout.splitlines()[-1].split(",")]
        solution = model.simulate(0.5, 0.01, method=method, **options)  # type: ignore[arg-type]
        assert last[:4] == pytest.approx([0.5, solution.q[-1, 0], solution.v[-1, 0], solution.a[-1, 0]], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("words", [("0.0105", "1e-3", "7"), ("0.4", "1", "1")])
def test_program_ends_where_it_is_told_to(words: tuple[str, ...], tmp_path: Path) -> None:
    eomgen.generate(cart(), tmp_path / "c", method="rk4")
    rows = [line.split(",") for line in run(compiled(tmp_path / "c"), *words, "tilt=0.25").stdout.splitlines()[1:]]
    end, step, every = (float(word) for word in words)
    options = {"method": "rk4", "record_every": int(every), "inputs": {"tilt": 0.25}}
    solution = eomgen.build(cart(), method="rk4", profile="reproducible").simulate(end, step, **options)  # type: ignore[arg-type]
    assert [float(row[0]) for row in rows] == solution.t.tolist()
    assert [float(row[1]) for row in rows] == pytest.approx(solution.q[:, 0], rel=1e-13)


def test_program_refuses_what_it_cannot_take(tmp_path: Path) -> None:
    eomgen.generate(cart(), tmp_path / "c")
    program = compiled(tmp_path / "c")
    names = "there is no tunable parameter or input 'psh'; there are: drag push tilt"
    for words, text in (
        (["psh=1"], names),
        (["push=fast"], "usage error: push: 'fast' is not a finite number"),
        (["push="], "usage error: push: '' is not a finite number"),
        (["drag=nan"], "usage error: drag: 'nan' is not a finite number"),
        (["1", "1e-3", "1", "1"], "[name=value ...], numbers positive"),
        (["-1"], "[name=value ...], numbers positive and without units"),
        (["1s", "1ms"], "numbers positive and without units"),
        (["1,5"], "numbers positive and without units"),
        (["1", "1e-3", "2.5"], "numbers positive and without units"),
    ):
        result = run(program, *words)
        assert (result.returncode, result.stdout) == (2, "")
        assert text in result.stderr


def test_program_without_stepper_takes_parameters(tmp_path: Path) -> None:
    folder = write_folder(generate_files(to_program(pendulum())), tmp_path / "model")
    program = compiled(folder)
    plain, heavy = (run(program, *words).stdout.splitlines()[0].split(",") for words in ((), ("mass=6",)))
    assert plain[0] == heavy[0] == "mass.M"
    assert [float(x) for x in heavy[1:]] == pytest.approx([3.0 * float(x) for x in plain[1:]], rel=1e-12)
    refused = run(program, "3")
    assert refused.returncode == 2 and refused.stderr.startswith("usage: ")


def test_names_in_literals_are_escaped_and_still_found(tmp_path: Path) -> None:
    assert c_string("arm_2") == '"arm_2"' and c_string('a"é') == '"\\141\\042\\303\\251"'
    program = compiled(write_folder(generate_files(to_program(hostile())), tmp_path / "model"))
    for k, name in enumerate(HOSTILE):
        values = run(program, f"{name}=100").stdout.strip().split(",")
        before = run(program).stdout.strip().split(",")
        changed = [place for place, (one, other) in enumerate(zip(values, before, strict=True)) if one != other]
        assert changed == [k + 1]


def top() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("top", gravity=[0, 0, -9.81])
    builder.body("top", 15.0, center_of_mass=[0, 1, 0], inertia=[0.25, 0.47, 0.25])
    return builder.joint("pivot", "spherical", "base", "top", initial={"velocity": [0, 150, -4.6]}).build()


@pytest.mark.slow
def test_a_stepper_defines_the_group_functions_that_it_calls(tmp_path: Path) -> None:
    families = {type(method_named(name)): name for name in reversed(method_names()) if "index3" not in name}
    assert len(families) > 10
    for name in families.values():
        try:
            eomgen.generate(top(), tmp_path / name, method=name)
        except eomgen.ModelError:  # for systems of another kind
            continue
        command = [shutil.which("cc") or "gcc", *STRICT, "-O0", "-c", *map(str, (tmp_path / name).glob("*.c"))]
        result = subprocess.run(command, cwd=tmp_path / name, check=False, capture_output=True, text=True)
        assert (name, result.stderr) == (name, "")


def test_a_named_method_that_cannot_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(eomgen.ModelError, match=r"rk4 cannot run on this scene: .*without constraints"):
        eomgen.generate("examples/four_bar/scene.toml", tmp_path / "c", method="rk4")
