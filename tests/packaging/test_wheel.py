"""The wheel stands alone: built, installed into an empty environment outside the checkout, and used for a scene, a
robot, a beam, an ensemble and generated C."""

from __future__ import annotations

import io
import json
import lzma
import math
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

CHECKOUT = Path(__file__).parents[2]
#: Bytes of the wheel at most: 3.707 million on 30 November 2026 with contacts, cars and suspensions (shares of
#: docstrings in docs/contributing/decisions.md).
LARGEST = 3_750_000
#: Bytes of one file of it, compressed, at most: tables, meshes and pictures would be larger; text of modules is less.
LARGEST_FILE = 20_000
#: Bytes of the archive of examples, compressed, at most.
LARGEST_EXAMPLES = 135_000

SCENE = """
format = 1
name = "wheel_pendulum"
[parameters]
length = { value = 1.0, unit = "m", tunable = true }
[bodies.bob]
mass = 1.0
center_of_mass = [0, 0, "-length"]
inertia = [0, 0, 0]
[joints.hinge]
type = "revolute"
parent = "base"
child = "bob"
axis = [0, 1, 0]
initial = { position = 0.5 }
[simulation]
method = "rk4"
duration = 1.0
step = 1e-3
"""
ROBOT = """
<robot name="rod">
  <link name="ground"/>
  <link name="rod">
    <inertial>
      <origin xyz="0 0 -0.5"/><mass value="2"/>
      <inertia ixx="0.16666666666666666" iyy="0.16666666666666666" izz="1e-4" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/></joint>
</robot>
"""
BEAM = """
format = 1
name = "wheel_cantilever"
gravity = [0, 0, 0]
[beams.blade]
length = 2.0
bending_y = { shapes = "finite_elements", elements = 8, modes = 3 }
[beams.blade.section]
elastic_modulus = 2e11
density = 8000
area = 1e-4
second_moments = [1e-9, 1e-9]
[joints.root]
type = "fixed"
parent = "base"
child = "blade"
"""
PROGRAM = """
import json, subprocess, sys
from pathlib import Path
import eomgen
from eomgen.toolchain import builder
from eomgen.toolchain.compiler import Compilation, find_compiler

here = Path(sys.argv[1])
assert Path(eomgen.__file__).is_relative_to(sys.prefix), eomgen.__file__

def final(model, **options):
    solution = model.simulate(1.0, 1e-3, method="rk4", **options)
    assert solution.success, solution.message
    return solution

model = eomgen.build(here / "scene.toml", profile="quick")
solution = final(model)
solution.animate(here / "page.html")
solution.plot("q")[0].figure.savefig(here / "angle.png")
robot = final(eomgen.build(here / "robot.urdf", profile="quick"), initial={"hinge": 0.5})
heavier = []
for mass in ("2.3", "2.9"):
    (here / "rod.urdf").write_text((here / "robot.urdf").read_text().replace('value="2"', f'value="{mass}"'))
    rod = eomgen.build(here / "rod.urdf", profile="quick")
    heavier.append(float(final(rod, initial={"hinge": 0.5}).q[-1, 0]))
    builder.Compilation = None  # for the second mass
builder.Compilation = Compilation
modes = eomgen.build(here / "beam.toml", profile="quick").linearize().modes()
samples = model.simulate_many(1.0, 1e-3, method="rk4", vary={"length": "values(0.8, 1.0, 1.25)"}, error_estimate=False)
eomgen.generate(here / "scene.toml", here / "c")
command = json.loads((here / "c" / "manifest.json").read_text())["compile"].split()
subprocess.run([*find_compiler().command, *command[1:]], cwd=here / "c", check=True)
run = subprocess.run([here / "c" / "wheel_pendulum"], cwd=here / "c", check=True, capture_output=True, text=True)
print(json.dumps({
    "scene": float(solution.q[-1, 0]),
    "robot": float(robot.q[-1, 0]),
    "heavier": heavier,
    "frequency": float(modes.frequency[0]),
    "lengths": samples.values["length"].tolist(),
    "ensemble": samples.results["q.hinge.final"].tolist(),
    "c": [float(number) for number in run.stdout.splitlines()[-1].split(",")[:2]],
}))
"""


def swing(stiffness: float) -> float:
    """Return the angle after 1 s of x'' = -stiffness sin x from 0.5 at rest, by Runge's and Kutta's method."""
    x, v, h = 0.5, 0.0, 1e-3
    for _ in range(1000):
        a1 = -stiffness * math.sin(x)
        a2 = -stiffness * math.sin(x + h / 2 * v)
        a3 = -stiffness * math.sin(x + h / 2 * v + h * h / 4 * a1)
        a4 = -stiffness * math.sin(x + h * v + h * h / 2 * a2)
        x, v = x + h * v + h * h / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return x


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the files that distributions are made of: two processes would share a folder ``build`` in the checkout, and
    find what is left there."""
    folder = tmp_path_factory.mktemp("source")
    for path in CHECKOUT.iterdir():
        if path.name in ("eomgen", "templates", "examples"):
            shutil.copytree(path, folder / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.is_file():
            shutil.copy(path, folder)
    return folder


def _built(source: Path, folder: Path) -> Path:
    """Return the wheel of a folder or an archive of sources."""
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    command = [sys.executable, "-m", "pip", "wheel", *options, "-w", str(folder), str(source)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
    (found,) = folder.glob("eomgen-*.whl")
    return found


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _built(source, tmp_path_factory.mktemp("wheel"))


def names_in(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def _below(top: Path, pattern: str) -> list[str]:
    files = (path for start in top.glob(pattern) for path in (start, *start.rglob("*")) if path.is_file())
    return [path.relative_to(top).as_posix() for path in files if "__pycache__" not in path.parts]


def test_wheel_carries_templates_and_examples_and_no_tests(wheel: Path) -> None:
    names = names_in(wheel)
    start = "eomgen/_templates/"
    there = set(_below(CHECKOUT / "templates", "*"))
    assert {"c/model/model.c.jinja", "pictures/animation.html"} <= there
    assert {name.removeprefix(start) for name in names if name.startswith(start)} == there
    with zipfile.ZipFile(wheel) as archive:
        whole = io.BytesIO(lzma.decompress(archive.read("eomgen/_examples.zip.xz")))
    with zipfile.ZipFile(whole) as packed:
        carried = packed.namelist()
        assert all(item.compress_type == zipfile.ZIP_STORED for item in packed.infolist())
    assert {"four_bar/scene.toml", "four_bar/README.md"} <= set(carried)
    endings = (".c", ".csv", ".md", ".py", ".tir", ".toml")
    examples = (name for name in _below(CHECKOUT / "examples", "*/") if not name.startswith("verification/"))
    assert sorted(carried) == sorted(name for name in examples if name.endswith(endings))
    assert {name.partition("/")[0].partition("-")[0] for name in names} == {"eomgen"}
    stubs = {f"eomgen/products/{owner}_methods.pyi" for owner in ("model", "solution")}
    assert {"eomgen/py.typed", *stubs} <= set(names)


def test_wheel_is_pure_and_small(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")
    assert wheel.stat().st_size <= LARGEST
    with zipfile.ZipFile(wheel) as archive:
        examples = archive.getinfo("eomgen/_examples.zip.xz")
        files = [item for item in archive.infolist() if not item.filename.endswith(("/RECORD", examples.filename))]
    assert examples.compress_size <= LARGEST_EXAMPLES
    assert [item.filename for item in files if item.compress_size > LARGEST_FILE] == []


@pytest.mark.long
def test_source_distribution_makes_the_same_wheel(source: Path, wheel: Path, tmp_path: Path) -> None:
    code = f"from setuptools.build_meta import build_sdist; print(build_sdist({str(tmp_path)!r}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True, text=True)
    again = _built(tmp_path / done.stdout.split()[-1], tmp_path)
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(again) as other:
        assert sorted(one.namelist()) == sorted(other.namelist())
        assert [name for name in one.namelist() if one.read(name) != other.read(name)] == []


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a new environment with the wheel and its dependencies, and without packages of any other."""
    folder = tmp_path_factory.mktemp("empty") / "environment"
    venv.create(folder, with_pip=False, symlinks=os.name != "nt")
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    command = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-compile", str(wheel)]
    subprocess.run(command, check=True, env=_outside(), capture_output=True, timeout=600)
    return python


def _outside() -> dict[str, str]:
    """Return the environment without variables that name the checkout, whose metadata pip would take for an
    installation."""
    return {name: text for name, text in os.environ.items() if not name.startswith("PYTHON")}


def ran(command: list[str], folder: Path, **variables: str) -> str:
    """Return the output of a program in a folder."""
    environment = {**_outside(), "EOMGEN_CACHE": str(folder / "cache"), **variables}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def numbers(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Any]:
    """Numbers of runs with the installed wheel."""
    here = tmp_path_factory.mktemp("outside")
    for name, text in (("scene.toml", SCENE), ("robot.urdf", ROBOT), ("beam.toml", BEAM)):
        (here / name).write_text(text, encoding="utf-8")
    result: dict[str, Any] = json.loads(ran([str(installed), "-I", "-c", PROGRAM, str(here)], here))
    assert (here / "page.html").stat().st_size > 10_000 and (here / "angle.png").stat().st_size > 5_000
    return result


def test_an_installed_wheel_runs_a_scene_and_its_generated_c(numbers: Mapping[str, Any]) -> None:
    assert abs(numbers["scene"] - swing(9.81)) < 1e-9
    assert numbers["c"] == [1.0, numbers["scene"]]  # without contraction of products and sums both have the same bits


def test_an_installed_wheel_runs_a_robot(numbers: Mapping[str, Any]) -> None:
    assert abs(numbers["robot"] - swing(1.5 * 9.81)) < 1e-9  # a thin rod of 1 m about its end: m g l / 2 over m l^2 / 3


def test_another_mass_needs_no_compiler_on_any_system(numbers: Mapping[str, Any]) -> None:
    expected = [swing(0.5 * mass * 9.81 / (1.0 / 6.0 + 0.25 * mass)) for mass in (2.3, 2.9)]
    assert max(abs(one - other) for one, other in zip(numbers["heavier"], expected, strict=True)) < 1e-9


def test_an_installed_wheel_runs_a_beam(numbers: Mapping[str, Any]) -> None:
    expected = 1.8751040687**2 * math.sqrt(2e11 * 1e-9 / (8000 * 1e-4 * 2.0**4)) / (2 * math.pi)
    assert abs(numbers["frequency"] / expected - 1.0) < 1e-5


def test_an_installed_wheel_runs_an_ensemble(numbers: Mapping[str, Any]) -> None:
    assert numbers["lengths"] == [0.8, 1.0, 1.25]
    expected = [swing(9.81 / length) for length in numbers["lengths"]]
    assert max(abs(one - other) for one, other in zip(numbers["ensemble"], expected, strict=True)) < 1e-9


def test_the_installed_program_names_its_version(installed: Path, wheel: Path, tmp_path: Path) -> None:
    program = installed.with_name("eomgen.exe" if os.name == "nt" else "eomgen")
    assert ran([str(program), "--version"], tmp_path) == f"eomgen {wheel.name.split('-')[1]}\n"
