"""SDF: M and forces of every joint type as Drake has them, loops, gearboxes, and a message with line for each fault."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.cli import main
from eomgen.pipeline.pipeline import derive
from eomgen.products.robots.sdf.conversion import sdf_data
from eomgen.scene.load import load
from tests.oracles.evaluation import tape_evaluator
from tests.robots.tables import table

FILES = Path(__file__).parents[1] / "files"
EVERY_JOINT = FILES / "every_joint.sdf"
TEXT = EVERY_JOINT.read_text(encoding="utf-8")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "model.sdf"


def test_mass_and_forces_are_drakes() -> None:
    # Drake's ball joint has angles about fixed axes, and its velocity is the angular velocity in axes of the parent.
    reference = json.loads((FILES / "every_joint_by_drake.json").read_text(encoding="utf-8"))
    system = derive(load(EVERY_JOINT), ["mass", "residual"])
    evaluate, factors = tape_evaluator(system), {factor.name: factor for factor in system.factors}
    assert sum(joint[5] for joint in reference["joints"]) == system.nv == 8
    for state in reference["states"]:
        q, A = np.zeros(sum(factor.q_size for factor in system.factors)), np.zeros((8, 8))
        for name, kind, q_start, q_size, v_start, v_size in reference["joints"]:
            factor, given = factors[name], state["q"][q_start : q_start + q_size]
            turn = np.eye(v_size)
            if kind == "ball_rpy":
                rotation = Rotation.from_euler("xyz", given)
                given, turn = rotation.as_quat(scalar_first=True), rotation.as_matrix().T
            q[factor.q_start : factor.q_start + len(given)] = given
            A[factor.v_start : factor.v_start + v_size, v_start : v_start + v_size] = turn
        at = {"q": q, "v": A @ np.array(state["v"]), "a": np.zeros(8), "t": np.zeros(1)}
        at |= {"lam": np.zeros(0), "u": np.zeros(0), "z": np.zeros(0)}
        M, r = evaluate("mass", {"q": q})["M"].reshape(8, 8), np.ravel(evaluate("residual", at)["r"])
        np.testing.assert_allclose(A.T @ M @ A, state["M"], atol=1e-13)
        np.testing.assert_allclose(A.T @ r, state["r"], atol=1e-12)


GEARS = Path(__file__).with_name("gears.sdf").read_text(encoding="utf-8").rstrip()


@pytest.mark.parametrize(("old", "new", "message"), table("faults_of_sdf"))
def test_faults_have_file_line_and_remedy(old: str, new: str, message: str, file: Path) -> None:
    assert old in TEXT
    file.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match=message):
        load(file)


@pytest.mark.parametrize(("old", "new", "note"), table("unread_parts_of_sdf"))
def test_no_part_of_a_file_passes_unread(old: str, new: str, note: str, file: Path) -> None:
    file.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    assert any(said.startswith(note) for said in load(file).notes)
    with pytest.raises(eomgen.DescriptionError, match=r"try: no --strict"):
        load(file, strict=True)


OLD = Path(__file__).with_name("old.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("minor", "world", "pose", "axis", "gravity"),
    [
        (4, "<physics><gravity>1 2 3</gravity></physics>", "", [0.0, np.cos(0.7), -np.sin(0.7)], [1.0, 2.0, 3.0]),
        (5, "<physics><gravity>1 2 3</gravity></physics>", "", [0.0, 1.0, 0.0], [1.0, 2.0, 3.0]),
        (6, "<gravity>1 2 3</gravity>", 'frame="base"', [0.0, 1.0, 0.0], [1.0, 2.0, 3.0]),
        (6, "", 'frame="bases"', "bases", []),
        (
            7,
            "<physics><gravity>1 2 3</gravity></physics>",
            "",
            "not read: elements <gravity> of <physics> (1) [W0193]",
            [],
        ),
        (7, "", 'frame="base"', "not read: the attribute 'frame' of <pose> (1: arm) [W0193]", []),
    ],
)
def test_older_versions_keep_their_meaning(
    minor: int, world: str, pose: str, axis: list[float] | str, gravity: list[float]
) -> None:
    text = OLD.format(minor, world, pose)
    if axis == "bases":
        with pytest.raises(eomgen.DescriptionError, match=r"model\.sdf:3: relative_to: there is no frame 'bases'"):
            sdf_data(text, file="model.sdf")
        return
    result = sdf_data(text, file="model.sdf")
    if isinstance(axis, str):
        assert axis in result.notes
    else:
        np.testing.assert_allclose(result.data["joints"]["hinge"]["axis"], axis, atol=1e-15)
        assert result.data["gravity"] == gravity


def test_the_command_line_takes_sdf(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(GEARS, encoding="utf-8")
    assert main(["info", str(file), "--json"]) == 0
    assert '"gears"' in capsys.readouterr().out
    file.write_text('<sdf version="1.7"/>', encoding="utf-8")
    assert main(["info", str(file)]) == 3
    assert 'model.sdf:1: the file has no <model>; try: <model name="...">' in capsys.readouterr().err
