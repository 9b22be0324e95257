"""Random scene files against an interpreter that knows docs/scene.md alone.

``python -m tests.oracles.interpreter.compare --scenes 3000`` runs as many as wanted.
"""

from __future__ import annotations

import copy

import pytest

from tests.oracles.interpreter.compare import disagreements
from tests.oracles.interpreter.generator import scene

KINDS = ("tree", "loop", "absolute", "beam", "hull", "exact_beam")


@pytest.mark.slow
@pytest.mark.long_cases("beam")
@pytest.mark.parametrize("kind", KINDS)
def test_random_scenes_agree(kind: str, monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    assert disagreements(scene(1, kind), 1, kind) == []


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_more_random_scenes_agree(kind: str, monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    found = {seed: disagreements(scene(seed, kind), seed, kind) for seed in range(2, 5)}
    assert {seed: wrong for seed, wrong in found.items() if wrong} == {}


@pytest.mark.slow
@pytest.mark.parametrize("key, factor", [("mass", 1 + 1e-9), ("center_of_mass", 1 + 1e-9), ("inertia", 1 + 1e-9)])
def test_the_comparison_sees_a_change_of_a_billionth(
    key: str, factor: float, monkeypatch: pytest.MonkeyPatch, tmp_path
) -> None:
    """The interpreter reads one scene, eomgen another."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    data = scene(3, "tree")
    changed = copy.deepcopy(data)
    body = next(body for body in reversed(list(changed["bodies"].values())) if key in body)
    value = body[key]
    if key == "mass":
        body[key] = f"({value}) * {factor!r}"
    elif isinstance(value, dict):
        body[key] = {name: number * factor for name, number in value.items()}
    else:
        body[key] = [[x * factor for x in row] if isinstance(row, list) else row * factor for row in value]
    assert disagreements(data, 3, "tree", built=changed)
