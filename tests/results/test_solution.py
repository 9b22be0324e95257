"""Solutions on disk: both formats read back, and what is said when a disk is full or a file is not ours."""

from __future__ import annotations

import csv
import errno
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.models.scenes import flyer, pendulum


def test_npz_reads_back_everything(tmp_path: Path) -> None:
    run = pendulum().simulate(0.2, 1e-3, parameters={"length": 0.7})
    path = run.save(tmp_path / "run.npz")
    again = eomgen.Solution.load(path)
    for name in ("t", "q", "v", "a", "z", "multipliers"):
        np.testing.assert_array_equal(getattr(run, name), getattr(again, name))
    assert set(again.outputs) == {"tip", "angle"} and set(again.energy) == {
        "kinetic",
        "potential",
        "total",
        "power",
        "base_power",
    }
    np.testing.assert_array_equal(run.outputs["tip"], again.outputs["tip"])
    assert (again.message, again.success, again.interrupted) == (run.message, True, False)
    assert again.stats == run.stats and again.metadata == run.metadata
    assert again.metadata["scene"] == "shaken" and again.metadata["version"] == eomgen.__version__
    assert again.metadata["method"] == "generalized_alpha" and again.metadata["parameters"]["length"] == 0.7


def test_csv_has_named_columns_of_the_same_bits(tmp_path: Path) -> None:
    run = flyer().simulate(0.02, 1e-3)
    path = run.save(tmp_path / "run.csv")
    with path.open(newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows[0][:4] == ["t", "q.root[0]", "q.root[1]", "q.root[2]"]
    assert rows[0][1 + 11 : 1 + 12 + 1] == ["q.slide", "v.root[0]"]
    assert rows[0][-5:] == ["energy.kinetic", "energy.potential", "energy.power", "energy.base_power", "energy.total"]
    table = np.array(rows[1:], dtype=float)
    assert table.shape == (21, 1 + 12 + 10 + 10 + 5)
    np.testing.assert_array_equal(table[:, 1:13], run.q)
    np.testing.assert_array_equal(table[:, 13:23], run.v)
    np.testing.assert_array_equal(table[:, -1], run.energy["total"])


def test_outputs_are_columns(tmp_path: Path) -> None:
    names = list(pendulum().simulate(0.0).columns())
    assert names[:4] == ["t", "q.hinge", "v.hinge", "a.hinge"]
    assert names[4:9] == ["input.torque", "output.tip[0]", "output.tip[1]", "output.tip[2]", "output.angle"]


def test_a_component_of_an_output_is_a_column_by_its_name_in_formulas() -> None:
    run = pendulum().simulate(0.02, 1e-3)
    np.testing.assert_array_equal(run["tip[2]"], run.outputs["tip"][:, 2])
    np.testing.assert_array_equal(run["output.tip[2]"], run["tip[2]"])
    with pytest.raises(eomgen.UsageError, match=r"there is no column 'tip\[3\]'"):
        run["tip[3]"]


def test_other_suffixes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(
        eomgen.UsageError, match=r"a solution cannot be saved as \.xlsx; try: \.npz, \.csv, \.mat or \.parquet"
    ):
        pendulum().simulate(0.0).save(tmp_path / "run.xlsx")


def test_a_full_disk_is_named_and_the_old_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.npz"
    run = pendulum().simulate(0.1, 1e-3)
    run.save(path)
    before = path.read_bytes()

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(
        eomgen.FileError,
        match=(
            r"run\.npz: cannot be written \(No space left on device\); about \d{4,} bytes are needed; try: another"
            r" disk, or a larger record_every"
        ),
    ):
        run.save(path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_unwritable_paths_and_foreign_files_are_named(tmp_path: Path) -> None:
    run = pendulum().simulate(0.0)
    with pytest.raises(eomgen.FileError, match=r"nowhere/run\.npz: cannot be written \(No such file or directory\)"):
        run.save(tmp_path / "nowhere" / "run.npz")
    with pytest.raises(eomgen.FileError, match=r"run\.npz: cannot be read: No such file or directory"):
        eomgen.Solution.load(tmp_path / "run.npz")
    foreign = tmp_path / "foreign.npz"
    foreign.write_text("not an archive")
    with pytest.raises(eomgen.FileError, match=r"foreign\.npz: this is not a solution written by eomgen"):
        eomgen.Solution.load(foreign)
    np.savez(foreign, t=np.zeros(3))
    with pytest.raises(eomgen.FileError, match=r"foreign\.npz: this is not a solution written by eomgen"):
        eomgen.Solution.load(foreign)
