"""SDF against the URDF and the MJCF of the same machine."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.errors import DescriptionError
from tests.models.urdf import ROBOTS
from tests.oracles.sdf_twins import sdf_twin

FILES = Path(__file__).parents[1] / "files"


@pytest.mark.parametrize("second", ["twin.urdf", "twin.xml"])
def test_three_formats_have_one_machine(second: str) -> None:
    comparison = eomgen.compare(FILES / "twin.sdf", FILES / second, tolerance=1e-11)
    assert comparison.equal, comparison
    assert comparison.matched == 3
    assert max(comparison.errors.values()) <= 1e-11


def compared(urdf: Path, minor: int, folder: Path) -> eomgen.Comparison:
    """Compare a robot with its twin of SDF 1.``minor``."""
    twin = folder / "twin.sdf"
    twin.write_text(sdf_twin(urdf.read_text(encoding="utf-8"), minor), encoding="utf-8")
    # right angles of few digits are made exact, other ones in the frame of a model than in the frames of joints
    return eomgen.compare(urdf, twin, tolerance=1e-11 if minor >= 7 else 1e-8, states=3)


@pytest.mark.parametrize("minor", [4, 6, 10])
@pytest.mark.parametrize("name", ["panda_description/urdf/panda.urdf", "talos_data/robots/talos_full_v2.urdf"])
def test_robots_are_their_twins(name: str, minor: int, tmp_path: Path) -> None:
    comparison = compared(ROBOTS / name, minor, tmp_path)
    assert comparison.equal, comparison
    assert comparison.matched >= 6


@pytest.mark.long
def test_a_quarter_of_all_robots_are_their_twins(tmp_path: Path) -> None:
    equal = 0
    for path in sorted(ROBOTS.rglob("*.urdf"))[::4]:
        try:
            comparison = compared(path, 10, tmp_path)
        except DescriptionError as error:  # names of links and joints are one set in SDF
            assert "twin.sdf" not in str(error) or "there twice" in str(error)
            continue
        assert comparison.equal, comparison
        equal += 1
    assert equal >= 12
