"""Start of a process: budgets of imported modules and compiled classes, counted exactly, since times depend on the
machine. A budget grows with a reason only."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.models.scenes import PENDULUM_TOML

ROOT = Path(__file__).parents[1]
#: Packages and slow modules of Python that most processes need not import.
SLOW = (
    *("sympy", "scipy", "jinja2", "matplotlib", "pydantic", "click", "cffi", "pint", "setuptools"),
    *("concurrent", "csv", "difflib", "email", "html", "importlib.metadata", "logging", "subprocess"),
    *("statistics", "tempfile", "tomllib", "zipfile"),
)
#: Reading leaves three notes.
ARM_URDF = """
<robot name="arm">
  <link name="ground"/>
  <link name="arm">
    <inertial>
      <origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="ground"/><child link="arm"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""
_PROGRAM = """
import json, sys, dataclasses
before, compiled, process = set(sys.modules), [], dataclasses._process_class
dataclasses._process_class = lambda kind, *options: compiled.append(kind.__module__) or process(kind, *options)
import eomgen
{work}
new = set(sys.modules) - before
print(json.dumps([
    *(len([name for name in names if name.partition(".")[0] == "eomgen"]) for names in (new, compiled)),
    sorted(name for name in {slow!r} if name in new),
]))
"""


def start(work: str, cache: Path) -> tuple[int, int, list[str]]:
    """Return the numbers of eomgen's modules and of compiled dataclasses in a new process, and the slow modules."""
    environment = {**os.environ, "EOMGEN_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    program = _PROGRAM.format(work=work, slow=SLOW)
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment, cwd=cache.parent
    )
    modules, classes, slow = json.loads(result.stdout)
    return modules, classes, slow


def check(counted: tuple[int, int, list[str]], modules: int, classes: int, slow: list[str]) -> None:
    """Raise AssertionError if a process does more than its budget."""
    assert counted[2] == slow
    assert counted[0] <= modules
    assert counted[1] <= classes


def test_an_import_is_three_modules(tmp_path: Path) -> None:
    check(start("", tmp_path / "cache"), 3, 0, [])


def test_a_scene_that_was_read_before_needs_no_reader(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    work = 'eomgen.load("scene.toml")'
    first = start(work, tmp_path / "cache")
    # not importlib.metadata, by which pydantic looks for plugins, nor modules for random processes and for mistakes
    check(first, 184, 13, ["pydantic", "tomllib"])
    check(start(work, tmp_path / "cache"), 71, 1, [])


#: Schemas of a file with bodies and joints alone, and the schema of the file.
SCHEMAS = (
    *("BodyEntry", "BodyFrame", "FrictionEntry", "Initial", "JointEntry", "Limits", "MimicEntry"),
    *("PointEntry", "RotationEntry", "SceneDocument", "SceneDocument", "SimulationEntry", "Table"),
)
_SCHEMAS = """
from eomgen.scene.reading.key_metadata import Table
every = [Table]
for kind in every:
    every += kind.__subclasses__()
assert sorted(kind.__name__ for kind in every) == {schemas!r}, every
"""


def test_a_first_reading_imports_what_the_file_mentions(tmp_path: Path) -> None:
    """No class of pydantic, no force element and no product of other sections."""
    (tmp_path / "arm.urdf").write_text(ARM_URDF, encoding="utf-8")
    counted = start(f"eomgen.load('arm.urdf')\n{_SCHEMAS.format(schemas=[*SCHEMAS])}", tmp_path / "cache")
    check(counted, 186, 5, ["pydantic"])


def test_a_model_of_a_loaded_scene_is_the_one_of_its_record(tmp_path: Path) -> None:
    """A Scene made from a record keeps description and key, and a build asks for none of its force elements."""
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    start('eomgen.load("scene.toml")', tmp_path / "cache")
    look = """
from eomgen.pipeline.readings import record_of
scene = eomgen.load("scene.toml")
assert record_of(scene).scene is scene and record_of(scene).content == scene.digest
assert "elements" not in vars(scene)
"""
    assert start(look, tmp_path / "cache")[2] == []


@pytest.mark.slow
def test_a_cached_model_needs_no_scene(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    work = 'model = eomgen.build("scene.toml", profile="quick")'
    step = f"{work}; model.simulate(1e-3, 1e-3)"
    first = start(step, tmp_path / "cache")
    assert {"sympy", "scipy", "matplotlib", "pint", "setuptools"}.isdisjoint(first[2])
    check(start(work, tmp_path / "cache"), 131, 3, [])
    check(start(step, tmp_path / "cache"), 176, 12, [])
    loaded = step.replace('build("scene.toml"', 'build(eomgen.load("scene.toml")')
    check(start(loaded, tmp_path / "cache"), 184, 12, [])


@pytest.mark.slow
def test_a_changed_number_needs_neither_printer_nor_compiler(tmp_path: Path) -> None:
    """Nor schedules, NumPy's random numbers and solvers of constraints."""
    work = 'model = eomgen.build("arm.urdf", profile="quick"); model.simulate(1e-3, 1e-3)'
    names = ("eomgen.codegen.scheduling.scheduler", "numpy.random", "eomgen.solvers.consistency")
    look = f"{work}\nassert not {names!r} & sys.modules.keys()".replace(f"{names!r}", f"set({names!r})")
    for mass in ("1", "1.01"):
        changed = ARM_URDF.replace('mass value="1"', f'mass value="{mass}"')
        (tmp_path / "arm.urdf").write_text(changed, encoding="utf-8")
        counted = start(look if mass != "1" else work, tmp_path / "cache")
    check(counted, 353, 18, ["pydantic", "tempfile"])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2, reason="figures are drawn there")
def test_the_process_of_a_second_run_reads_and_draws_nothing(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    work = """
import contextlib, io
from eomgen.cli import main
with contextlib.redirect_stdout(io.StringIO()):
    main(["simulate", "scene.toml", "--out", "out", "--t-end", "0.01", "--profile", "quick"])
"""
    start(work, tmp_path / "cache")
    check(start(work, tmp_path / "cache"), 237, 18, ["click", "csv", "zipfile"])


def test_the_program_of_a_small_linkage_needs_no_scipy(tmp_path: Path) -> None:
    """Its equations, samples of its matrices and the order of their elimination."""
    work = f"""
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
method = method_named("generalized_alpha")
method_data(method, method.prepared(eomgen.derive({str(ROOT / "examples" / "four_bar" / "scene.toml")!r})), 1e-3)
"""
    assert {"scipy", "sympy", "jinja2"}.isdisjoint(start(work, tmp_path / "cache")[2])
