"""The benchmark of ensembles checks its numbers."""

from __future__ import annotations

import pytest

from benchmarks import ensembles


@pytest.mark.long
def test_processes_of_dask_give_the_bits_of_threads(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    assert ensembles.main(["--quick"]) == 0
    assert "40 samples, the same bits" in capsys.readouterr().out
