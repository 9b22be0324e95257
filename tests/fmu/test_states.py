"""States of FMUs: random rollbacks, and states that go on in another process, have the bits of the plain motion."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.files import template_folder
from tests.fmu.importers import Unit, recorded, written

ROOT = Path(__file__).parents[2]
#: Scenes with events, samples, corrections and contacts, in both versions.
UNITS = {
    "bouncing_ball/scene.toml": 3,
    "pi_servo/sampled.toml": 2,
    "four_bar/scene.toml": 2,
    "gear_with_backlash/scene.toml": 3,
}
ROLLBACKS = 200
#: Goes on from bytes in a file by one step, and prints the values of all states and outputs.
OTHER_PROCESS = """
import json, sys
from pathlib import Path
from tests.fmu.importers import Unit, recorded
file, bytes_, t, step = sys.argv[1:]
unit = Unit(Path(file))
unit.go_back(unit.read(Path(bytes_).read_bytes()))
unit.fmu.doStep(float(t), float(step))
print(json.dumps(unit.get(*recorded(Path(file)))))
"""


@pytest.mark.long_except("bouncing_ball/scene.toml")
@pytest.mark.slow
@pytest.mark.parametrize("name", UNITS)
def test_rollbacks_and_other_processes_have_the_same_bits(name: str, tmp_path: Path, rng: np.random.Generator) -> None:
    loaded = eomgen.load(ROOT / "examples" / name)
    file, step, steps = written(loaded, UNITS[name]), loaded.simulation.step, 120
    names, unit = recorded(file), Unit(file)
    plain, kept = [], []
    for k in range(steps):
        kept.append(unit.state())
        unit.fmu.doStep(k * step, step)
        plain.append(unit.get(*names))
    for _ in range(ROLLBACKS):
        done = int(rng.integers(steps - 3))
        unit.go_back(kept[done])
        for k in range(done, done + int(rng.integers(1, 4))):
            unit.fmu.doStep(k * step, step)
            assert unit.get(*names) == plain[k]
    (tmp_path / "state").write_bytes(unit.bytes_of(kept[50]))
    words = [sys.executable, "-c", OTHER_PROCESS, str(file), str(tmp_path / "state"), repr(50 * step), repr(step)]
    other = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    assert json.loads(other.stdout) == plain[50]


class Integrated(Unit):
    """An FMU in model exchange, which Euler's method integrates; events at completed steps are handled."""

    def __init__(self, file: Path, step: float) -> None:
        super().__init__(file, "me")
        self.step = step
        self.continuous()
        self.rate = np.zeros(len(self.x))

    def settle(self) -> None:
        """Update discrete states until none needs another update."""
        while self.update()[0]:
            pass
        self.fmu.enterContinuousTimeMode()

    def go_on(self, t: float) -> None:
        """Take one step from time t."""
        self.fmu.setTime(t)
        self.fmu.getContinuousStates(self.pointer, len(self.x))
        rates = self.fmu.getDerivatives if self.version == 2 else self.fmu.getContinuousStateDerivatives
        rates(self.rate.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), len(self.x))
        self.x += self.step * self.rate
        self.fmu.setTime(t + self.step)
        self.fmu.setContinuousStates(self.pointer, len(self.x))
        if self.fmu.completedIntegratorStep()[0]:
            self.fmu.enterEventMode()
            self.settle()


@pytest.mark.slow
@pytest.mark.parametrize(("version", "minimal"), [(2, False), (3, True)])
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

    plain, unit = motion(Integrated(file, step), 0, steps), Integrated(file, step)
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
    other = Integrated(file, step)
    other.go_back(other.read(unit.bytes_of(kept[50][1])))
    assert motion(other, 50, 60) == plain[50:60]


#: Integrates an FMU and goes back; its library has sanitizers, which end the process.
SANITIZED = """
import sys
from pathlib import Path
from tests.fmu.test_states import Integrated
unit = Integrated(Path(sys.argv[1]), 5e-4)
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
@pytest.mark.skipif(sys.platform != "linux", reason="the sanitizers are loaded before Python, by Linux alone")
@pytest.mark.parametrize(("version", "minimal"), [(2, True), (3, False)])
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
    words = [sys.executable, "-c", SANITIZED, str(tmp_path / "sanitized.fmu")]
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr[-2000:]
