"""The check can fail: errors planted in derivations are found in compiled models, and named."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest

import eomgen
from eomgen.cli import main
from eomgen.mechanics import derive as derive_module
from eomgen.mechanics.constraints.rows import ConstraintCalculus
from eomgen.mechanics.dynamics import separated
from eomgen.studies import check
from tests.models.library import scene_file


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Wrong models must not stay where other tests look for theirs."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("EOMGEN_CACHE", str(folder))
        yield folder


def sign_of_partials(patch: pytest.MonkeyPatch) -> None:
    from eomgen.mechanics import scene_tape

    original = scene_tape.inertial_partials

    def wrong(*arguments: object) -> object:
        K, C, M = original(*arguments)  # type: ignore[arg-type]
        return K, [[C[0][0], -C[0][1]], C[1]], M

    patch.setattr(scene_tape, "inertial_partials", wrong)


def factor_of_coupling(patch: pytest.MonkeyPatch) -> None:
    original = separated.coupling
    patch.setattr(separated, "coupling", lambda tree: [0.999 * value for value in original(tree)])


def missing_base_motion(patch: pytest.MonkeyPatch) -> None:
    original = separated.base_motion
    patch.setattr(separated, "base_motion", lambda tree, base: [value - value for value in original(tree, base)])


def late_rates(patch: pytest.MonkeyPatch) -> None:
    original = derive_module._blocks

    def wrong(scene_tape: object, name: str) -> object:
        blocks = list(original(scene_tape, name))  # type: ignore[arg-type]
        last = blocks[-1]
        late = replace(last, refs=(-last.refs[0], *last.refs[1:])) if name == "rates" else last
        return [*blocks[:-1], late]

    patch.setattr(derive_module, "_blocks", wrong)


def missing_bias(patch: pytest.MonkeyPatch) -> None:
    original = ConstraintCalculus.bias
    patch.setattr(ConstraintCalculus, "bias", lambda self: [value - value for value in original(self)])


def swing(folder: Path, name: str) -> Path:
    """Write the arm on a base that moves, with a torque over time."""
    moves = {
        f"joints__{joint}__initial": {"position": 0.4, "velocity": v}
        for joint, v in (("shoulder", 0.8), ("elbow", -0.5))
    }
    base = {"position": ["0.1 * sin(5 * t)", 0, "0.2 * t**2"]}
    torques = {"shoulder_torque": {"formula": "0.2 * sin(3 * t)"}, "elbow_torque": {"formula": 0}}
    return scene_file(folder, "arm", description=name, base=base, inputs=torques, **moves)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize(
    ("plant", "form", "coordinates"),
    [
        (factor_of_coupling, "coupling.h", "joint"),
        (missing_base_motion, "base_motion.b", "joint"),
        (late_rates, "rates.tau_ddot", "joint"),
        (missing_bias, "constraint_bias.g", "absolute"),
    ],
)
def test_an_error_in_a_derivation_is_found_in_the_compiled_model(
    plant: Callable[[pytest.MonkeyPatch], None],
    form: str,
    coordinates: Literal["joint", "absolute"],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = eomgen.load(swing(tmp_path, plant.__name__), coordinates=coordinates)
    plant(monkeypatch)
    report = check(scene, states=3, only=[form], profile="quick")
    assert [item.name for item in report.failures] == [form]


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_an_error_ends_with_exit_code_6_and_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["check", str(swing(tmp_path, "sign")), "--states", "3", "--only", "partials"]
    with monkeypatch.context() as patch:
        sign_of_partials(patch)
        assert main(command) == 6
    output = capsys.readouterr()
    verdicts = {line.split()[0]: line.split()[-1] for line in output.out.splitlines() if line.startswith("partials.")}
    assert verdicts == {"partials.K": "agrees", "partials.C": "FAILS", "partials.M": "agrees"}
    said = [line for line in output.err.splitlines() if line.startswith("partials.C FAILS: v.shoulder along v.elbow: ")]
    assert len(said) == 1 and re.search(
        r": -?[0-9.e-]+, but -?[0-9.e-]+ by [a-z ]+ \(known to .*\), at .*state", said[0]
    )
    assert "1 of 3 closed forms not shown to agree" in output.err
