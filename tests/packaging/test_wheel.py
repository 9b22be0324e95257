"""The wheel stands alone: built, installed outside the checkout, and used to run a scene."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

CHECKOUT = Path(__file__).parents[2]

SCENE = """
format = 1
name = "wheel_pendulum"
[bodies.bob]
mass = 1.0
center_of_mass = [0, 0, -1]
inertia = [0, 0, 0]
[joints.hinge]
type = "revolute"
parent = "base"
child = "bob"
axis = [0, 1, 0]
initial = { position = 0.5 }
"""

PROGRAM = """
import pathlib, sys
import eomgen
assert pathlib.Path(eomgen.__file__).is_relative_to(sys.argv[1]), eomgen.__file__
model = eomgen.build(eomgen.load(sys.argv[2]))
solution = model.simulate(1.0, 1e-3)
assert solution.success, solution.message
solution.animate(sys.argv[3])
print(float(solution.q[-1, 0]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel in a copy: two processes would share a folder ``build`` in the checkout, and find what is left
    there."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for path in CHECKOUT.iterdir():
        if path.name in ("eomgen", "templates"):
            shutil.copytree(path, source / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.is_file():
            shutil.copy(path, source)
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
        ".",
    ]
    subprocess.run(command, cwd=source, check=True, capture_output=True, timeout=300)
    (found,) = folder.glob("eomgen-*.whl")
    return found


def test_wheel_carries_the_templates_and_no_tests(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    folder = CHECKOUT / "templates"
    templates = sorted(
        str(path.relative_to(folder))
        for path in folder.rglob("*")
        if path.is_file() and path.parent.name != "__pycache__"
    )
    assert {"c/model/model.c.jinja", "html/animation.html"} <= set(templates)
    carried = [name.removeprefix("eomgen/_templates/") for name in names if name.startswith("eomgen/_templates/")]
    assert sorted(carried) == templates
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/", "examples/"))]


def test_installed_wheel_runs_a_scene_outside_the_checkout(wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(site), str(wheel)]
    subprocess.run(install, check=True, capture_output=True, timeout=300)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(site), "EOMGEN_CACHE": str(tmp_path / "cache")}
    command = [sys.executable, "-c", PROGRAM, str(site), str(scene), str(tmp_path / "page.html")]
    run = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert run.returncode == 0, run.stderr
    # theta(1 s) of a pendulum of length 1 m from 0.5 rad at rest, by RK4 with 1e5 steps of the one equation
    assert abs(float(run.stdout) - -0.499157187) < 1e-5
