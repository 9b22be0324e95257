"""States of FMUs: random rollbacks, and states that go on in another process, have the bits of the plain motion."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.fmu.importers import recorded, written
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
