"""Parts of SDF by hand: poses by homogeneous matrices, included models, threads, loops, mimics, visuals, addresses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.errors import DescriptionError
from eomgen.pipeline.pipeline import derive
from eomgen.products.robots.sdf.conversion import sdf_data
from eomgen.products.robots.uris import is_remote, is_there, locate, package_folders
from eomgen.scene.load import from_data
from eomgen.scene.sources.source import OptionError
from tests.oracles.evaluation import tape_evaluator
from tests.robots.tables import table


def sdf(content: str, minor: int = 12) -> str:
    return f'<sdf version="1.{minor}">{content}</sdf>'


def model(content: str, name: str = "m", head: str = "") -> str:
    return f'<model name="{name}">{head}{content}</model>'


def rest(content: str, head: str = "") -> str:
    """Return a model at rest, whose links are frames of the base, and a ball that moves."""
    return sdf(model(content, head=f"<static>true</static>{head}") + model('<link name="ball"/>', "moving"))


def link(name: str, pose: str = "0 0 0 0 0 0", more: str = "") -> str:
    return f'<link name="{name}"><pose>{pose}</pose>{more}</link>'


def joint(name: str, kind: str, parent: str, child: str, axis: str = "<axis><xyz>0 1 0</xyz></axis>") -> str:
    return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{axis}</joint>'


def data_of(text: str, **options: Any) -> dict[str, Any]:
    return sdf_data(text, file="model.sdf", **options).data


def matrix(pose: str) -> np.ndarray:
    """Return the homogeneous matrix of a position and of angles about fixed axes."""
    numbers = [float(word) for word in pose.split()]
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = Rotation.from_euler("xyz", numbers[3:]).as_matrix(), numbers[:3]
    return result


def frame(data: dict[str, Any], name: str) -> np.ndarray:
    """Return the homogeneous matrix of a frame of a scene, which is on the base."""
    entry = data["frames"][name]
    assert entry["body"] == "base"
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = entry["orientation"], entry["position"]
    return result


P, L, F, T = "0.1 0.2 0.3 0.4 -0.2 0.5", "0.3 0 -0.1 0.1 0.2 0.3", "0 0.5 0.2 -0.3 0.1 0", "0.2 0.1 0 0 0.6 -0.1"


# -- poses -------------------------------------------------------------------------------------------------------------


def test_frames_stand_in_the_frames_that_they_name() -> None:
    """A frame within a frame of a link of a model, and a model within the model, whose frame is of its own link."""
    inner = model(link("tip", T), "inner", f'<pose relative_to="f">{P}</pose>')
    content = link("a", L) + f'<frame name="f" attached_to="a"><pose>{F}</pose></frame>'
    content += f'<frame name="g"><pose relative_to="f">{T}</pose></frame>' + inner
    data = data_of(rest(content, f"<pose>{P}</pose>"))
    whole = matrix(P) @ matrix(L) @ matrix(F)
    for name, expected in (
        ("m__a", matrix(P) @ matrix(L)),
        ("m__f", whole),
        ("m__g", whole @ matrix(T)),
        ("m__inner__tip", whole @ matrix(P) @ matrix(T)),
    ):
        np.testing.assert_allclose(frame(data, name), expected, atol=1e-12)


def test_a_placement_frame_stands_at_the_pose_of_its_model() -> None:
    content = link("a", L) + f'<frame name="f" attached_to="a"><pose>{F}</pose></frame>'
    head = f"<pose>{P}</pose><static>true</static>{content}"
    text = sdf(f'<model name="m" placement_frame="f">{head}</model>' + model('<link name="ball"/>', "moving"))
    data = data_of(text)
    np.testing.assert_allclose(frame(data, "m__f"), matrix(P), atol=1e-12)
    np.testing.assert_allclose(frame(data, "m__a"), matrix(P) @ np.linalg.inv(matrix(F)), atol=1e-12)


@pytest.mark.parametrize(
    ("canonical", "carrier"), [("", "a"), (' canonical_link="b"', "b"), (' canonical_link="inner::c"', "inner__c")]
)
def test_the_frame_of_a_model_is_on_its_canonical_link(canonical: str, carrier: str) -> None:
    links = link("a") + link("b", "1 0 0 0 0 0") + model(link("c", "2 0 0 0 0 0"), "inner")
    data = data_of(sdf(f'<model name="m"{canonical}>{links}<frame name="f"><pose>{F}</pose></frame></model>'))
    assert data["frames"]["f"]["body"] == carrier
    offset = {"a": 0.0, "b": 1.0, "inner__c": 2.0}[carrier]
    np.testing.assert_allclose(data["frames"]["f"]["position"], [-offset, 0.5, 0.2], atol=1e-15)


def test_a_model_of_models_has_the_first_link_among_them() -> None:
    links = model(link("c"), "one") + model(link("d"), "two")
    data = data_of(sdf(model(links + '<frame name="f"/>')))
    assert data["frames"]["f"]["body"] == "one__c"


@pytest.mark.parametrize("words", ['degrees="true"', 'rotation_format="quat_xyzw"', "scaled"])
def test_rotations_in_degrees_and_quaternions(words: str) -> None:
    angles = np.array([0.3, -0.5, 0.8])
    x, y, z, w = Rotation.from_euler("xyz", angles).as_quat()
    turn = " ".join(map(repr, np.degrees(angles).tolist()))
    if "degrees" not in words:
        size = 1.0004 if words == "scaled" else 1.0
        turn, words = " ".join(repr(float(size * part)) for part in (x, y, z, w)), 'rotation_format="quat_xyzw"'
    data = data_of(rest(link("a") + f'<frame name="f"><pose {words}>1 2 3 {turn}</pose></frame>'))
    np.testing.assert_allclose(frame(data, "m__f"), matrix("1 2 3 0.3 -0.5 0.8"), atol=1e-9)


# -- threads, loops and mimics -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("thread", "pitch"),
    [
        ("", 0.5 / np.pi),
        ("<screw_thread_pitch>0.3</screw_thread_pitch>", 0.15 / np.pi),
        ("<screw_thread_pitch>0.3</screw_thread_pitch><thread_pitch>5</thread_pitch>", 0.15 / np.pi),
        ("<thread_pitch>4</thread_pitch>", -0.25),
    ],
)
def test_threads_are_in_metres_per_turn_or_in_radians_per_metre(thread: str, pitch: float) -> None:
    axis = f"<axis><xyz>0 0 1</xyz></axis>{thread}"
    data = data_of(sdf(model(link("a") + joint("s", "screw", "world", "a", axis))))
    assert data["joints"]["s"]["pitch"] == pytest.approx(pitch, rel=1e-15)


RING = "".join(
    link(name, pose) for name, pose in (("a", "0 0 0 0 0 0"), ("b", "0.3 0 0 0 0 0.4"), ("c", "0.5 0 0 0 0 0"))
)
RING += joint("1", "revolute", "world", "a") + joint("2", "revolute", "a", "b") + joint("3", "revolute", "world", "c")


def test_a_joint_of_a_ring_becomes_a_constraint_of_its_type() -> None:
    """Its rows vanish in the configuration of the file, and else, of a ball, have the gap by hand."""
    last = joint("4", "revolute", "c", "b").replace("<axis>", '<pose relative_to="b">0.4 0 0 0 0 0</pose><axis>')
    data = data_of(sdf(model(RING + last)))
    assert list(data["joints"]) == ["_1", "_2", "_3"] and data["constraints"]["_4"]["type"] == "revolute"
    evaluate = tape_evaluator(derive(from_data(data), ["constraint"]))
    assert np.linalg.norm(evaluate("constraint", {"q": np.zeros(3), "t": np.zeros(1)})["Phi"]) < 1e-15
    q = np.array([0.3, -0.5, 0.7])

    def turned(angle: float, *point: float) -> np.ndarray:
        return Rotation.from_rotvec([0.0, angle, 0.0]).apply(point)

    # in frame b the axis is (0, 1, 0), too; b is turned by 0.4 about z, so its axis in a is the one of the file
    R = Rotation.from_euler("z", 0.4)
    on_b = turned(q[0], *(np.array([0.3, 0, 0]) + R.apply(Rotation.from_rotvec([0, q[1], 0]).apply([0.4, 0, 0]))))
    at = np.array([0.3, 0, 0]) + R.apply([0.4, 0, 0]) - [0.5, 0, 0]
    on_c = np.array([0.5, 0, 0]) + turned(q[2], *at)
    ball = data_of(sdf(model(RING + last.replace('"revolute"', '"ball"').replace("<axis><xyz>0 1 0</xyz></axis>", ""))))
    assert ball["constraints"]["_4"]["type"] == "spherical" and "axis" not in ball["constraints"]["_4"]["first"]
    rows = tape_evaluator(derive(from_data(ball), ["constraint"]))("constraint", {"q": q, "t": np.zeros(1)})["Phi"]
    assert np.linalg.norm(rows) == pytest.approx(np.linalg.norm(on_b - on_c), rel=1e-12)


DYNAMIC = "<axis><xyz>0 1 0</xyz><dynamics>{}</dynamics></axis>"
CUT = "<physics><simbody><must_be_loop_joint>true</must_be_loop_joint></simbody></physics>"


def test_forces_of_a_joint_that_the_file_makes_close_a_loop() -> None:
    """A damper is a bushing along z of the constraint; the joint with it would be of the tree otherwise."""
    damper = DYNAMIC.format("<damping>0.4</damping><friction>0.3</friction>")
    text = sdf(model(RING + joint("4", "revolute", "c", "b", damper + CUT)))
    found = sdf_data(text, file="model.sdf")
    assert found.data["bushings"]["_4_damper"]["rotational_damping"] == [0.0, 0.0, 0.4]
    first = found.data["constraints"]["_4"]["first"]
    assert found.data["bushings"]["_4_damper"]["first"] == first and first["body"] == "c"
    assert any(note.startswith("not modelled: dry friction of joints that close loops (1: _4)") for note in found.notes)
    assert list(data_of(text.replace(CUT, ""))["constraints"]) == ["_3"]
    sliding = data_of(text.replace('name="4" type="revolute"', 'name="4" type="prismatic"'))
    assert sliding["bushings"]["_4_damper"]["damping"] == [0.0, 0.0, 0.4]


SCREW = "<axis><xyz>0 1 0</xyz></axis><thread_pitch>4</thread_pitch>"
TWO = "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>{}</xyz></axis2>"


def test_screws_and_universal_joints_close_loops_by_their_numbers() -> None:
    screw = data_of(sdf(model(RING + joint("4", "screw", "c", "b", SCREW + CUT))))["constraints"]["_4"]
    assert (screw["type"], screw["pitch"]) == ("helical", -0.25)
    # the joint's frame is of b: x along its first axis, y along the second one, and z across both
    cross = data_of(sdf(model(RING + joint("4", "universal", "c", "b", TWO.format("1 0 0") + CUT))))["constraints"][
        "_4"
    ]
    np.testing.assert_allclose(cross["second"]["x_axis"], [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(cross["second"]["axis"], [0.0, 0.0, -1.0], atol=1e-15)


def test_a_universal_joint_with_oblique_axes_is_two_revolute_joints() -> None:
    axes = "<axis><xyz>1 0 0</xyz><dynamics><damping>0.1</damping></dynamics></axis>"
    axes += "<axis2><xyz>0.6 0.8 0</xyz><dynamics><damping>0.2</damping><spring_stiffness>3</spring_stiffness>"
    axes += "</dynamics></axis2>"
    text = sdf(model(link("a", "0 0 1 0 0 0") + link("b") + joint("u", "universal", "a", "b", axes)))
    found = sdf_data(text, file="model.sdf")
    first, second = found.data["joints"]["u"], found.data["joints"]["u_second"]
    assert (first["parent"], first["child"], second["parent"], second["child"]) == ("a", "u_between", "u_between", "b")
    assert first["axis"] == [1.0, 0.0, 0.0] and second["axis"] == [0.6, 0.8, 0.0]
    assert (
        first["damping"] == 0.1 and second["damping"] == 0.2 and second["stiffness"] == 3.0 and "stiffness" not in first
    )
    np.testing.assert_allclose(first["position"], [0.0, 0.0, -1.0])
    assert "position" not in second and found.data["bodies"]["u_between"] == {"mass": 0.0}
    assert any(note.startswith("axes of u are not perpendicular") for note in found.notes)


#: A universal joint u of axes x and y, and a hinge h on its link.
LEAD = TWO.format("0 0 1").replace("<xyz>0 1 0</xyz>", "<xyz>1 0 0</xyz>")
LEADING = link("a") + link("b") + joint("u", "universal", "world", "a", LEAD)
MIMIC = '<axis><xyz>0 0 1</xyz><mimic joint="{}" axis="{}"><multiplier>2</multiplier><offset>0.5</offset>'
MIMIC += "<reference>0.1</reference></mimic></axis>"


@pytest.mark.parametrize("axis", ["axis", "axis2"])
def test_a_joint_mimics_one_axis_of_two(axis: str) -> None:
    """q = 2 (q_leader - 0.1) + 0.5, as a row."""
    data = data_of(sdf(model(LEADING + joint("h", "revolute", "a", "b", MIMIC.format("u", axis)))))
    entry = data["constraints"]["h_mimic"]
    system = derive(from_data(data), ["constraint"])
    q = {"u": [0.3, 0.7], "h": [0.2]}
    state = np.concatenate([q[factor.name] for factor in system.factors])
    leader = 0.3 if axis == "axis" else 0.7
    row = tape_evaluator(system)("constraint", {"q": state, "t": np.zeros(1)})["Phi"]
    assert row == pytest.approx([0.2 - (2.0 * (leader - 0.1) + 0.5)], rel=1e-14)
    assert entry["unit"] == "rad"


def test_a_mimic_of_one_coordinate_is_a_key() -> None:
    content = link("a") + link("b") + joint("u", "revolute", "world", "a")
    data = data_of(sdf(model(content + joint("h", "revolute", "a", "b", MIMIC.format("u", "axis")))))
    assert data["joints"]["h"]["mimic"] == {"joint": "u", "multiplier": 2.0, "offset": pytest.approx(0.3)}


GEAR = (link("a") + link("b", "1 0 0 0 0 0") + joint("1", "revolute", "world", "a") + "{}"
        '<joint name="g" type="gearbox"><parent>a</parent><child>b</child><gearbox_ratio>3</gearbox_ratio>'
        "<gearbox_reference_body>{}</gearbox_reference_body><axis><xyz>0 1 0</xyz></axis>"
        "<axis2><xyz>0 1 0</xyz></axis2></joint>"
        )  # fmt: skip  # one text


def test_a_mimic_leads_by_either_of_two_revolute_joints() -> None:
    """Which take the place of a universal joint with oblique axes."""
    oblique = LEADING.replace("<axis2><xyz>0 0 1</xyz>", "<axis2><xyz>0.6 0 0.8</xyz>")
    for axis, leader in (("axis", "u"), ("axis2", "u_second")):
        data = data_of(sdf(model(oblique + joint("h", "revolute", "a", "b", MIMIC.format("u", axis)))))
        assert data["joints"]["h"]["mimic"]["joint"] == leader


HELD = link("c") + joint("0", "fixed", "world", "c")


@pytest.mark.parametrize(
    ("second", "sign"),
    [(joint("2", "revolute", "world", "b"), 1), (joint("2", "revolute", "world", "b").replace("0 1 0", "0 -2 0"), -1)],
)
def test_a_gearbox_turns_its_child_against_its_parent(second: str, sign: int) -> None:
    """theta_2 + 3 theta_1, of angles along the gearbox's axes: minus the coordinate of a joint in the other sense."""
    data = data_of(sdf(model(HELD + GEAR.format(second, "c"))))
    system = derive(from_data(data), ["constraint"])
    q = {"_1": 0.3, "_2": 0.7}
    state = np.array([q[factor.name] for factor in system.factors])
    row = tape_evaluator(system)("constraint", {"q": state, "t": np.zeros(1)})["Phi"]
    assert row == pytest.approx([sign * 0.7 + 3.0 * 0.3], rel=1e-14)


# -- included models ---------------------------------------------------------------------------------------------------


PART = sdf(model(link("piece", L) + '<frame name="tip" attached_to="piece"/>' + link("other", T), "part"), 8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "part.sdf").write_text(PART, encoding="utf-8")
    return tmp_path


def including(more: str, folder: Path, words: str = "", beside: str = "", address: str = "part.sdf") -> dict[str, Any]:
    """Return the scene of a world that includes a part beside a ball."""
    include = f"<include {words}><uri>{address}</uri>{more}</include>"
    text = sdf(f'<world name="w">{beside}{model(link("ball"), "moving")}{include}</world>')
    return data_of(text, path=folder / "model.sdf")


def test_an_include_gives_name_place_and_rest(folder: Path) -> None:
    moved = f"<name>mine</name><pose>{P}</pose><static>true</static>"
    data = including(moved, folder)
    np.testing.assert_allclose(frame(data, "mine__piece"), matrix(P) @ matrix(L), atol=1e-12)
    np.testing.assert_allclose(frame(data, "mine__other"), matrix(P) @ matrix(T), atol=1e-12)
    placed = including(moved + "<placement_frame>tip</placement_frame>", folder)
    np.testing.assert_allclose(frame(placed, "mine__tip"), matrix(P), atol=1e-12)
    moving = including("", folder)
    assert list(moving["bodies"]) == ["moving__ball", "part__piece", "part__other"]
    assert moving["joints"]["part__piece_free"]["initial"]["position"] == pytest.approx([0.3, 0.0, -0.1])


def test_a_merged_include_has_its_names_in_the_model_around(folder: Path) -> None:
    include = '<include merge="true"><uri>part.sdf</uri><pose>{}</pose></include>'
    text = rest(link("a") + include.format(P) + f'<frame name="f"><pose relative_to="tip">{F}</pose></frame>')
    data = data_of(text, path=folder / "model.sdf")
    np.testing.assert_allclose(frame(data, "m__piece"), matrix(P) @ matrix(L), atol=1e-12)
    np.testing.assert_allclose(frame(data, "m__f"), matrix(P) @ matrix(L) @ matrix(F), atol=1e-12)
    head = f'<model name="n" canonical_link="other">{include.format(P)}{link("x")}<frame name="g"/></model>'
    moving = data_of(sdf(head), path=folder / "model.sdf")
    assert moving["frames"]["g"]["body"] == "other" and moving["bodies"].keys() == {"x", "piece", "other"}
    twice = rest(link("piece") + include.format(P))
    with pytest.raises(DescriptionError, match="the included file has the name 'piece', which is there already"):
        data_of(twice, path=folder / "model.sdf")


def test_a_folder_of_a_model_names_its_newest_readable_file(folder: Path) -> None:
    home = folder / "robots" / "crane"
    home.mkdir(parents=True)
    for name in ("old", "new", "model"):
        (home / f"{name}.sdf").write_text(sdf(model(link(name), name)), encoding="utf-8")
    files = (("4", "old"), ("6", "new"), ("99", "none"))
    config = "".join(f'<sdf version="1.{minor}">{name}.sdf</sdf>' for minor, name in files)
    (home / "model.config").write_text(f"<model>{config}</model>", encoding="utf-8")
    assert "new__new" in including("", folder, address="robots/crane")["bodies"]
    (home / "model.config").write_text("<model><name>crane</name></model>", encoding="utf-8")
    assert "model__model" in including("", folder, address="robots/crane")["bodies"]
    (home / "model.config").unlink()
    assert "model__model" in including("", folder, address="robots/crane")["bodies"]


FAULTS_OF_INCLUDES = {
    "<include/>": "the include has no <uri>",
    "<include><uri>https://fuel/x</uri></include>": "'https://fuel/x' lies in a network, and only local files are read",
    "<include><uri>none.sdf</uri></include>": r"model\.sdf:1: 'none\.sdf' cannot be read: .*; try: a path from the",
    "<include><uri>two.sdf</uri></include>": r"two\.sdf:1: an included file has one model, and this one has 2",
    "<include><uri>broken.sdf</uri></include>": r"broken\.sdf:1: this is not XML",
    "<include><uri>strange.sdf</uri></include>": r"strange\.sdf:1: the outermost element is 'robot', not 'sdf'",
    "<include><uri>circle.sdf</uri></include>": r"circle\.sdf:1: files include one another in a circle: 'circle\.sdf'",
}


@pytest.mark.parametrize("include", FAULTS_OF_INCLUDES)
def test_includes_that_cannot_be(include: str, folder: Path) -> None:
    pair = model(link("a"), "one") + model(link("a"), "two")
    circle = model(link("a") + "<include><uri>circle.sdf</uri></include>")
    for name, text in (("two", sdf(pair)), ("broken", "<sdf"), ("strange", "<robot/>"), ("circle", sdf(circle))):
        (folder / f"{name}.sdf").write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError, match=FAULTS_OF_INCLUDES[include]):
        data_of(sdf(f'<world name="w">{include}</world>'), path=folder / "model.sdf")


# -- faults and parts without effect -----------------------------------------------------------------------------------


MASS = "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>{}</inertial>"
#: Parts of the contents of tables.
WORDS = {"A": link("a"), "B": link("b"), "RING": RING, "LEADING": LEADING, "HELD": HELD, "CUT": CUT}


@pytest.mark.parametrize(("content", "message"), table("refused_parts_of_sdf"))
def test_faults_are_named(content: str, message: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        data_of(sdf(content.format(**WORDS)), limits=True)
    assert message in str(caught.value) and "model.sdf:1" in str(caught.value)


@pytest.mark.parametrize(("content", "note"), table("noted_parts_of_sdf"))
def test_parts_without_a_counterpart_are_noted(content: str, note: str) -> None:
    notes = sdf_data(sdf(content.format(**WORDS)), file="model.sdf").notes
    assert any(note in said for said in notes), notes


def test_parts_that_say_nothing_are_not_noted() -> None:
    """As Gazebo saves them."""
    more = "<enable_wind>false</enable_wind><velocity_decay><linear>0</linear></velocity_decay>"
    found = sdf_data(sdf(model(link("a", more=more + MASS.format("<fluid_added_mass><xx>0</xx></fluid_added_mass>")))),
                     file="model.sdf", strict=True)  # fmt: skip  # one call
    assert not [note for note in found.notes if note.startswith("not")]


def test_welded_links_rest_where_they_are() -> None:
    text = sdf(model(link("a", P) + link("b") + joint("j", "revolute", "a", "b")))
    data = data_of(text, weld="a")
    assert list(data["bodies"]) == ["b"] and data["joints"]["j"]["parent"] == "base"
    np.testing.assert_allclose(frame(data, "a"), matrix(P), atol=1e-15)
    for name in ("world", "c"):
        with pytest.raises(OptionError, match=f"has no link or frame '{name}'"):
            data_of(text, weld=[name])


def test_gravity_does_not_pull_a_link_that_says_so() -> None:
    floating = model(link("a", more="<gravity>false</gravity>" + MASS.format("")))
    data = data_of(sdf(f'<world name="w"><gravity>0 1 -9</gravity>{floating}</world>'))
    (force,) = data["forces"].values()
    assert force["body"] == "a" and force["force"] == [0.0, -1.0, 9.0]


# -- visuals and addresses ---------------------------------------------------------------------------------------------


def visual(geometry: str, more: str = "") -> str:
    return f'<visual name="v"><geometry>{geometry}</geometry>{more}</visual>'


DIFFUSE = "<material><diffuse>{}</diffuse></material>"


def test_visuals_are_shapes_with_colours_and_poses() -> None:
    box = visual("<box><size>1 2 3</size></box>", f'<pose relative_to="f">{T}</pose>' + DIFFUSE.format("1 0.5 0 0.5"))
    ball = visual(
        "<sphere><radius>0.2</radius></sphere>", DIFFUSE.format("0 0 1") + "<transparency>0.25</transparency>"
    )
    round_ = visual("<ellipsoid><radii>1 2 3</radii></ellipsoid>")
    content = link("a", L, box + ball + round_) + f'<frame name="f" attached_to="a"><pose>{F}</pose></frame>'
    first, second, third = data_of(sdf(model(content)))["shapes"].values()
    assert (first["type"], first["size"], first["color"], first["opacity"]) == ("box", [1.0, 2.0, 3.0], "#ff8000", 0.5)
    expected = matrix(F) @ matrix(T)
    np.testing.assert_allclose(first["position"], expected[:3, 3], atol=1e-12)
    (turn,) = first["rotation"]
    unit = np.array(turn["axis"]) / np.linalg.norm(turn["axis"])
    np.testing.assert_allclose(Rotation.from_rotvec(turn["angle"] * unit).as_matrix(), expected[:3, :3], atol=1e-12)
    assert (second["type"], second["radius"], second["color"], second["opacity"]) == ("sphere", 0.2, "#0000ff", 0.75)
    assert third["semi_axes"] == [1.0, 2.0, 3.0] and "color" not in third


MESH = "<mesh><uri>{}</uri><scale>1 2 3</scale></mesh>"


def test_meshes_are_named_from_the_folder_of_the_file(folder: Path) -> None:
    """Of an included file, too; the package is a folder around, or given."""
    inner = folder / "parts"
    (inner / "meshes").mkdir(parents=True)
    (inner / "meshes" / "a.stl").write_bytes(b"")
    (inner / "part.sdf").write_text(
        sdf(model(link("p", more=visual(MESH.format("meshes/a.stl"))), "p")), encoding="utf-8"
    )
    own = link("a", more=visual(MESH.format("b.stl")) + visual(MESH.format("package://parts/meshes/a.stl")))
    text = sdf(model(own + "<include><uri>parts/part.sdf</uri></include>"))
    shapes = data_of(text, path=folder / "model.sdf")["shapes"].values()
    assert [shape["file"] for shape in shapes] == ["b.stl", "parts/meshes/a.stl", "parts/meshes/a.stl"]
    assert [shape["scale"] for shape in shapes] == [[1.0, 2.0, 3.0]] * 3


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (visual(MESH.format("https://x/a.stl")), "meshes lie in a network"),
        (visual(MESH.format("a.xyz")), "meshes of the kind '.xyz' are not read"),
        (visual(MESH.format("")), "a mesh names no file"),
        (visual("<sphere/>", DIFFUSE.format("1 1 1") + "<transparency>1</transparency>"), "the colour is transparent"),
        (visual("<sphere/>", DIFFUSE.format("1 1")), "diffuse: 4 numbers are needed here, not '1 1'"),
        (visual("<sphere><radius>0</radius></sphere>"), "radius of a sphere is not above 0"),
        (visual("<heightmap/>"), "no geometry is one of"),
        (visual("<sphere/>", '<pose relative_to="none"/>'), "there is no frame 'none'"),
    ],
)
def test_visuals_that_cannot_be_drawn_are_noted(shape: str, reason: str) -> None:
    found = sdf_data(sdf(model(link("a", more=shape))), file="model.sdf", strict=True)
    assert "shapes" not in found.data
    assert any(f"visuals that pictures leave out [W0175] (1: a): {reason}" in note for note in found.notes), found.notes


def test_addresses_lead_to_packages_around_or_given(tmp_path: Path) -> None:
    inner = tmp_path / "robot" / "urdf"
    inner.mkdir(parents=True)
    (tmp_path / "robot" / "a.stl").write_bytes(b"")
    given = {"other": tmp_path / "elsewhere"}
    for address, expected in {
        "file:///x/a.stl": Path("/x/a.stl"),
        "a.stl": inner / "a.stl",
        "package://robot/a.stl": tmp_path / "robot" / "a.stl",
        "model://other/b/a.stl": tmp_path / "elsewhere" / "b" / "a.stl",
        "other/b/a.stl": tmp_path / "elsewhere" / "b" / "a.stl",
        "package://none/a.stl": inner / "none" / "a.stl",
    }.items():
        assert locate(address, inner, given) == expected
    (inner / "other").mkdir()
    assert locate("other", inner, given) == inner / "other"  # a file there comes first
    assert not is_there(inner / ("x" * 5000)) and is_there(inner)
    assert [is_remote(text) for text in ("http://x", "https://x", "file://x", "x")] == [True, True, False, False]
    assert package_folders([f"r={tmp_path}"]) == package_folders(f"r={tmp_path}") == {"r": tmp_path}
    for text, said in (
        ("r", "'r' is not NAME=FOLDER"),
        ("=x", "is not NAME"),
        ("r=", "is not NAME"),
        ("r=/none", "no folder"),
    ):
        with pytest.raises(OptionError, match=said):
            package_folders([text])
