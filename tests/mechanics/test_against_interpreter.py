"""Random scene files against an interpreter that knows docs/scene.md alone.

``python -m tests.oracles.interpreter.compare --scenes 3000`` runs as many as wanted.
"""

from __future__ import annotations

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
