"""The comparison with OpenTURNS: same probability to first order, many more runs."""

from __future__ import annotations

import re

import pytest

from benchmarks import random_vibration_peers


@pytest.mark.slow
def test_openturns_finds_the_same_point_by_many_more_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("openturns")
    assert random_vibration_peers.main(["--quick"]) == 0
    told = capsys.readouterr().out
    row = re.search(r"^ +1\.1862 +\S+ \| +(\S+) +(\S+) +(\d+) \| +(\S+) +(\S+)$", told, re.MULTILINE)
    assert row is not None, told
    form, sorm, runs, own, quadratic = (float(word) for word in row.groups())
    assert own == pytest.approx(form, abs=2e-5)
    assert abs(quadratic - 0.9) < 2.5e-3 < abs(form - 0.9)
    assert abs(sorm - 0.9) < abs(form - 0.9)
    counts = re.search(r"eomgen: (\d+) runs, (\d+) adjoint runs, (\d+) tangents, and", told)
    assert counts is not None
    assert runs > 3 * sum(map(int, counts.groups()))
