"""Model directives: the scene of models that are welded to one another has Drake's equations, and faults have lines."""

from __future__ import annotations

import builtins
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.cli import main
from eomgen.pipeline.pipeline import derive
from eomgen.scene.load import load
from tests.oracles.evaluation import tape_evaluator

FILES = Path(__file__).parents[1] / "files"
WELDED = FILES / "welded.dmd.yaml"
TEXT = WELDED.read_text(encoding="utf-8")
#: Joints of Drake whose names are the links', by the names of free joints here.
FREE = {"flying__body": "flying__body_free"}


def test_equations_and_start_are_drakes() -> None:
    reference = json.loads((FILES / "welded_by_drake.json").read_text(encoding="utf-8"))
    scene = load(WELDED)
    system = derive(scene, ["mass", "residual"])
    evaluate, factors = tape_evaluator(system), {factor.name: factor for factor in system.factors}
    assert sum(joint[5] for joint in reference["joints"]) == system.nv == 20
    rest = np.array(reference["rest"])

    def mine(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        state, A = np.zeros(sum(factor.q_size for factor in system.factors)), np.zeros((20, 20))
        for name, kind, q_start, q_size, v_start, v_size in reference["joints"]:
            factor, given, turn = factors[FREE.get(name, name)], q[q_start : q_start + q_size], np.eye(v_size)
            if kind == "ball_rpy":
                rotation = Rotation.from_euler("xyz", given)
                given, turn = rotation.as_quat(scalar_first=True), rotation.as_matrix().T
            elif kind == "quaternion_floating":  # in the frame that carries it, and here in the world
                rotation = Rotation.from_quat(given[:4], scalar_first=True)
                turned = Rotation.from_matrix(rest[:3, :3]) * rotation
                given = np.concatenate([turned.as_quat(scalar_first=True), rest[:3, :3] @ given[4:] + rest[:3, 3]])
                turn = np.kron(np.eye(2), rotation.as_matrix().T)
            state[factor.q_start : factor.q_start + len(given)] = given
            A[factor.v_start : factor.v_start + v_size, v_start : v_start + v_size] = turn
        return state, A

    start, _ = mine(np.array(reference["start"]))
    for joint in scene.joints:
        if joint.initial_position:
            factor = factors[joint.name]
            own = start[factor.q_start : factor.q_start + factor.q_size]
            np.testing.assert_allclose([getattr(it, "value", it) for it in joint.initial_position], own, atol=1e-15)
    assert {joint.name for joint in scene.joints if joint.initial_position} >= {"left__rail", "flying__body_free"}
    for state in reference["states"]:
        q, A = mine(np.array(state["q"]))
        v, a, flying = A @ np.array(state["v"]), np.zeros(20), factors["flying__body_free"].v_start
        a[flying + 3 : flying + 6] = -np.cross(v[flying : flying + 3], v[flying + 3 : flying + 6])  # of turning axes
        at = {"q": q, "v": v, "a": a, "t": np.zeros(1)}
        at |= {"lam": np.zeros(0), "u": np.zeros(0), "z": np.zeros(0)}
        M, r = evaluate("mass", {"q": q})["M"].reshape(20, 20), np.ravel(evaluate("residual", at)["r"])
        np.testing.assert_allclose(A.T @ M @ A, state["M"], atol=1e-12)
        np.testing.assert_allclose(A.T @ r, state["r"], atol=1e-11)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("welded.dmd.yaml", "welded_fingers.dmd.yaml", "twin.urdf", "twin.sdf", "twin.xml", "hanging.sdf"):
        shutil.copy(FILES / name, tmp_path)
    return tmp_path


FAULTS = [
    (
        "file: hanging.sdf",
        "file: hanging.sd",
        r"dmd\.yaml:28: there is no file 'hanging\.sd'; try: a path from the folder",
    ),
    ("file: twin.urdf", "file: package://none/twin.urdf", r"yaml:5: there is no file .*; try: packages=\["),
    ("file: twin.urdf", "file: https://a.b/c.urdf", r"yaml:\d+: .* lies in a network"),
    ("left::column", "left::colum", r"yaml:10: the model 'left' has no frame 'colum'; try: column"),
    (
        "left::column",
        "left::slide",
        r"yaml:10: the frame 'slide' of 'left' moves against the link that carries the model",
    ),
    ("left::column", "lef::column", r"yaml:10: there is no model with the frame 'lef::column'; try: left"),
    ("parent: world", "parent: features::bob", r"the welds of the models run in a circle: left, features, grip, left"),
    ("base_frame: left::tool", "base_frame: grip", r"the frames name one another in a circle: grip"),
    ("features::arm", "left::arm", r"yaml:\d+: the model 'left' is welded twice"),
    ("features::arm", "features::leg", r"yaml:30: .*has no link or frame 'leg'"),
    (
        "shoulder: [0.2]",
        "shoulde: [0.2]",
        r"yaml:7: default_joint_positions: .* no moving joint 'shoulde'; try: shoulder",
    ),
    ("shoulder: [0.2]", "shoulder: [a]", r"yaml:7: default_joint_positions: numbers are needed here, not 'a'"),
    ("deg: [0, 0, 90]", "deg: [0, 90]", r"yaml:14: deg: 3 numbers are needed here, not '0 90'"),
    ("!Rpy { deg: [0, 0, 90]", "!Rpi { deg: [0, 0, 90]", r"yaml:14: rotation: the kind '!Rpi' is not read; try: !Rpy"),
    ("translation: [0, 0.5, 0]", "translation: !Uniform { min: 0 }", r"yaml:13: translation: a value that is drawn"),
    ("- add_weld", "- add_wel", r"yaml:9: the directive 'add_wel' is not known; try: add_weld"),
    ("name: left", "nam: left", r"yaml:4: there is no name"),
    (
        "      body:",
        "      bob:",
        r"yaml:\d+: default_free_body_pose: 'bob' is not a free link of the model; try: one of body",
    ),
    (
        "more::second::rest",
        "left::tool",
        r"yaml:\d+: base_frame: 'left::tool' moves, and a start is given in the world",
    ),
    ("welded_fingers", "welded", r"files of directives include one another in a circle"),
    ("  file: hanging", " file: hanging", r"yaml:\d+: this is not YAML"),
]


@pytest.mark.parametrize(("old", "new", "message"), FAULTS, ids=range(len(FAULTS)))
def test_faults_have_file_line_and_remedy(old: str, new: str, message: str, folder: Path) -> None:
    assert old in TEXT
    (folder / "welded.dmd.yaml").write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match=message):
        load(folder / "welded.dmd.yaml")


def test_parts_that_are_not_read_are_noted(folder: Path) -> None:
    file = folder / "welded.dmd.yaml"
    file.write_text(TEXT.replace("  file: twin.urdf", "  file: twin.urdf\n    visible: true", 1), encoding="utf-8")
    notes = load(file).notes
    assert "not read: visible of add_model" in notes
    assert "without a part in the equations of motion: 1 add_collision_filter_group" in notes
    with pytest.raises(eomgen.DescriptionError, match=r"dmd\.yaml:6: not read: visible of add_model; try: no --strict"):
        load(file, strict=True)


def test_a_scene_includes_directives_and_a_model_of_mujoco(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "directives:\n- add_model: {name: one, file: twin.xml}\n- add_model: {name: two, file: twin.urdf}\n"
    weld = "- add_weld: {parent: one::tool, child: two::column}\n"
    (folder / "two.dmd.yaml").write_text(text + weld, encoding="utf-8")
    scene = 'format = 1\nname = "s"\n[include.pair]\nfile = "two.dmd.yaml"\nposition = [0, 0, 1]\n'
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    joints = [joint.name for joint in load(folder / "scene.toml").joints if joint.type != "fixed"]
    assert joints == [f"pair_{one}__{name}" for one in ("one", "two") for name in ("shoulder", "rail", "wrist")]
    assert main(["info", str(folder / "two.dmd.yaml"), "--json"]) == 0
    assert '"two__wrist"' in capsys.readouterr().out
    assert eomgen.compare(folder / "two.dmd.yaml", folder / "two.dmd.yaml", tolerance=1e-11).equal


def test_links_that_rest_weigh_on_a_base_that_moves(folder: Path) -> None:
    parts = "".join(
        f'[include.{name}]\nfile = "{name}.{ending}"\nparent = "cart"\n'
        for name, ending in (("a", "sdf"), ("b", "xml"))
    )
    for name, ending in (("a", "sdf"), ("b", "xml")):
        content = (folder / f"twin.{ending}").read_text(encoding="utf-8")
        content = content.replace(
            '<link name="column"/>', '<link name="column"><inertial><mass>5</mass></inertial></link>'
        )
        content = content.replace('<body name="column">', '<body name="column"><geom size="0.1" mass="5"/>')
        (folder / f"{name}.{ending}").write_text(content, encoding="utf-8")
    cart = (
        '[bodies.cart]\nmass = 1\n[joints.run]\ntype = "prismatic"\naxis = [1, 0, 0]\nparent = "base"\nchild = "cart"\n'
    )
    (folder / "scene.toml").write_text(f'format = 1\nname = "s"\n{cart}{parts}', encoding="utf-8")
    system = derive(load(folder / "scene.toml"), ["mass"])
    M = tape_evaluator(system)("mass", {"q": np.zeros(7)})["M"].reshape(7, 7)
    run = next(factor.v_start for factor in system.factors if factor.name == "run")
    assert M[run, run] == pytest.approx(1.0 + 2 * (5.0 + 3.0 + 1.5 + 0.8 + 0.3), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("long.dmd.yaml", "directives:\n- add_model:\n    name: a\n    file: {}.sdf\n"),
        ("long.sdf", '<sdf version="1.9"><model name="m"><include>\n<uri>{}</uri></include></model></sdf>'),
    ],
)
def test_names_that_no_file_can_have_are_of_no_file(name: str, text: str, tmp_path: Path) -> None:
    """The system refuses to look for names of 300 letters."""
    (tmp_path / name).write_text(text.format("x" * 300))
    with pytest.raises(eomgen.DescriptionError, match=r"there is no file 'xxx|'xxx.* File name too long"):
        load(tmp_path / name)


def test_a_missing_package_has_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    imported: Callable[..., Any] = builtins.__import__

    def without_yaml(name: str, *rest: Any, **named: Any) -> Any:
        if name == "yaml":
            raise ImportError(name)
        return imported(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without_yaml)
    with pytest.raises(eomgen.UsageError, match=r"model directives are YAML.*; try: pip install 'eomgen\[yaml\]'"):
        load(WELDED)
