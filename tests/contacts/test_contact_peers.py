"""The scenes next to other programs' contacts: equal motions by equal laws; nothing here asserts a time."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import contact_peers


@pytest.mark.slow
def test_a_car_on_the_law_of_exudyn_moves_as_in_exudyn() -> None:
    theirs = contact_peers.exudyn_ways("car")[0].run(800)
    ours = contact_peers.eomgen_ways("car", "exudyn")[0].run(800)
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    other = contact_peers.eomgen_ways("car", "drake")[0].run(800)
    assert np.abs(other - theirs).max() > 1e-2  # the laws are not the same


@pytest.mark.slow
@pytest.mark.parametrize("work", contact_peers.WORKS)
def test_scenes_on_the_law_of_drake_move_as_in_drake(work: str) -> None:
    pytest.importorskip("pydrake")
    theirs = contact_peers.drake_ways(work)[0].run(1e-6)
    np.testing.assert_allclose(contact_peers.eomgen_ways(work, "drake")[1].run(1e-9), theirs, atol=1e-4)


@pytest.mark.slow
def test_the_script_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert contact_peers.main(["--quick", "--works", "car"]) == 0
    assert "eomgen, EXUDYN's law" in capsys.readouterr().out
