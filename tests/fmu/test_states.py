"""States of FMUs: random rollbacks, and states that go on in another process, have the bits of the plain motion."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

import eomgen
from eomgen.base.files import template_folder
from tests.fmu.importers import recorded, written
from tests.fmu.test_calls import Logged
from tests.fmu.test_parts import Unit

ROOT = Path(__file__).parents[2]
SCENES = ("bouncing_ball/scene.toml", "pi_servo/sampled.toml", "four_bar/scene.toml", "gear_with_backlash/scene.toml")
ROLLBACKS = 1000
#: Goes on from bytes in a file by one step, and prints the values of all states and outputs.
OTHER_PROCESS = """
import json, sys
from pathlib import Path
from tests.fmu.importers import recorded
from tests.fmu.test_parts import Unit
file, bytes_, t, step = sys.argv[1:]
unit = Unit(Path(file))
unit.fmu.setFMUState(unit.fmu.deserializeFMUState(Path(bytes_).read_bytes()))
unit.fmu.doStep(float(t), float(step))
print(json.dumps(unit.get(*recorded(Path(file)))))
"""


@pytest.mark.long
@pytest.mark.long_cases("pi_servo/sampled.toml", "four_bar/scene.toml", "gear_with_backlash/scene.toml")
@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_rollbacks_and_other_processes_have_the_same_bits(scene: str, tmp_path: Path, rng: np.random.Generator) -> None:
    loaded = eomgen.load(ROOT / "examples" / scene)
    file, step = written(loaded, 3), loaded.simulation.step
    names = recorded(file)
    plain, unit = [list[float]()], Unit(file)
    steps = 200
    for k in range(steps):
        unit.fmu.doStep(k * step, step)
        plain.append(unit.get(*names))
    unit = Unit(file)
    done, rollbacks = 0, 0
    kept: list[tuple[int, object]] = []
    while rollbacks < ROLLBACKS:
        if len(kept) < 8 and done < steps - 10 and rng.random() < 0.3:
            kept.append((done, unit.fmu.getFMUState()))
        if kept and (done > steps - 5 or rng.random() < 0.5):
            done, state = kept.pop(int(rng.integers(len(kept))))
            unit.fmu.setFMUState(state)
            unit.fmu.freeFMUState(state)
            rollbacks += 1
        elif done > steps - 5:
            unit, done = Unit(file), 0
        for _ in range(int(rng.integers(1, 4))):
            unit.fmu.doStep(done * step, step)
            done += 1
            assert unit.get(*names) == plain[done], (rollbacks, done)
    state = unit.fmu.getFMUState()
    (tmp_path / "state").write_bytes(bytes(unit.fmu.serializeFMUState(state)))
    words = [sys.executable, "-c", OTHER_PROCESS, str(file), str(tmp_path / "state"), repr(done * step), repr(step)]
    other = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    assert json.loads(other.stdout) == plain[done + 1]


class Integrated(Logged):
    """An FMU in model exchange, which Euler's method integrates; events at completed steps are handled."""

    def __init__(self, file: Path, version: int, step: float) -> None:
        self.path, self.step = file, step
        super().__init__("", version, "me")
        self.settle()
        self.count = fmpy.read_model_description(str(file)).numberOfContinuousStates
        self.x, self.rate = np.zeros(self.count), np.zeros(self.count)

    def file(self, name: str, version: int) -> Path:
        return self.path

    def settle(self) -> None:
        """Update discrete states until none needs another update."""
        while self.update()[0]:
            pass
        self.fmu.enterContinuousTimeMode()

    def go_on(self, t: float) -> None:
        """Take one step from time t."""
        pointers = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (self.x, self.rate)]
        self.fmu.setTime(t)
        self.fmu.getContinuousStates(pointers[0], self.count)
        rates = self.fmu.getDerivatives if self.version == 2 else self.fmu.getContinuousStateDerivatives
        rates(pointers[1], self.count)
        self.x += self.step * self.rate
        self.fmu.setTime(t + self.step)
        self.fmu.setContinuousStates(pointers[0], self.count)
        if self.fmu.completedIntegratorStep()[0]:
            self.fmu.enterEventMode()
            self.settle()


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("minimal", [False, True])
def test_rollbacks_of_model_exchange_have_the_same_bits(version: int, minimal: bool, rng: np.random.Generator) -> None:
    """Steps of Euler's method are coarse, so that corrections of the linkage fall among them."""
    scene = eomgen.load(ROOT / "examples" / "four_bar" / "scene.toml")
    file, step, steps = written(scene, version, minimal=minimal), scene.simulation.step, 120
    names = recorded(file)

    def motion(unit: Integrated, begin: int, end: int) -> list[list[float]]:
        rows = []
        for k in range(begin, end):
            unit.go_on(k * step)
            rows.append(unit.get(*names))
        return rows

    plain, unit = motion(Integrated(file, version, step), 0, steps), Integrated(file, version, step)
    kept = [(0, unit.state())]
    for k in range(steps - 10):
        assert motion(unit, k, k + 1) == plain[k : k + 1]
        kept.append((k + 1, unit.state()))
    for _ in range(ROLLBACKS):
        done, state = kept[int(rng.integers(len(kept)))]
        unit.go_back(state)
        ahead = int(rng.integers(1, 4))
        assert motion(unit, done, done + ahead) == plain[done : done + ahead]
    assert minimal or any("back on the constraints" in message for message in unit.messages)
    other = Integrated(file, version, step)
    other.go_back(other.read(unit.bytes_of(kept[50][1])))
    assert motion(other, 50, 60) == plain[50:60]


#: Integrates an FMU and goes back; its library has sanitizers, which end the process.
SANITIZED = """
import sys
from pathlib import Path
from tests.fmu.test_states import Integrated
unit = Integrated(Path(sys.argv[1]), int(sys.argv[2]), 5e-4)
begin = unit.state()
for k in range(60):
    unit.go_on(k * 5e-4)
last = unit.get("q.drive")
unit.go_back(begin)
for k in range(60):
    unit.go_on(k * 5e-4)
assert unit.get("q.drive") == last
unit.fmu.terminate()
unit.fmu.freeInstance()
print("done")
"""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the sanitizers are loaded before Python, by Linux alone")
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("minimal", [False, True])
def test_sanitizers_have_no_findings_in_model_exchange(version: int, minimal: bool, tmp_path: Path) -> None:
    scene = eomgen.load(ROOT / "examples" / "four_bar" / "scene.toml")
    with zipfile.ZipFile(written(scene, version, minimal=minimal)) as archive:
        archive.extractall(tmp_path / "fmu")
    (library,) = (tmp_path / "fmu" / "binaries").glob("*/*.so")
    flags = ["-O1", "-g", "-fPIC", "-shared", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    flags += [f"-DFMI{version}_OVERRIDE_FUNCTION_PREFIX", f"-I{template_folder() / 'fmu' / f'fmi{version}'}"]
    sources = sorted((tmp_path / "fmu" / "sources").glob("*.c"))
    subprocess.run(["gcc", *flags, *sources, "-o", library, "-lm"], check=True)
    with zipfile.ZipFile(tmp_path / "sanitized.fmu", "w") as archive:
        for file in sorted((tmp_path / "fmu").rglob("*")):
            archive.write(file, file.relative_to(tmp_path / "fmu"))
    found = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
    environment = {**os.environ, "LD_PRELOAD": found.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0"}
    words = [sys.executable, "-c", SANITIZED, str(tmp_path / "sanitized.fmu"), str(version)]
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_rollbacks_of_co_simulation_of_fmi_2_have_the_same_bits(scene: str, rng: np.random.Generator) -> None:
    loaded = eomgen.load(ROOT / "examples" / scene)
    file, step, steps = written(loaded, 2), loaded.simulation.step, 120
    names = recorded(file)
    plain, kept, unit = [list[float]()], [], Unit(file)
    for k in range(steps):
        kept.append(unit.fmu.getFMUstate())
        unit.fmu.doStep(k * step, step)
        plain.append(unit.get(*names))
    for _ in range(ROLLBACKS):
        done = int(rng.integers(steps))
        unit.fmu.setFMUstate(kept[done])
        unit.fmu.doStep(done * step, step)
        assert unit.get(*names) == plain[done + 1]
