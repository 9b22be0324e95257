"""The check can fail: errors planted in derivations are found in compiled models, and named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import pytest

import eomgen
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


def factor_of_coupling(patch: pytest.MonkeyPatch) -> None:
    original = separated.coupling
    patch.setattr(separated, "coupling", lambda tree: [0.999 * value for value in original(tree)])


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
