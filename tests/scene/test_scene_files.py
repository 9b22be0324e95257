"""Scene files: what is read, what it defaults to, and where every message points."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from eomgen.errors import DescriptionError, FileError, UsageError
from eomgen.formula.nodes import Number
from eomgen.scene.load import load, load_toml
from eomgen.scene.scene import Scene
from eomgen.scene.sources.toml import line_index

PENDULUM = """\
format = 1
name = "pendulum"
[parameters]
length = 0.8
damping = { value = 0.1, tunable = true, unit = "N*m*s" }
[bodies.link]
mass = "2*length"
center_of_mass = [0, 0, "-length/2"]
inertia = [0.1, 0.1, 0.01]
[joints.hinge]
type = "revolute"
parent = "base"
child = "link"
axis = [0, 1, 0]
"""
ZERO = (Number(0.0),) * 3


def read(extra: str = "", text: str = PENDULUM) -> Scene:
    return load_toml(text + extra, file="scene.toml")


def problems(extra: str = "", text: str = PENDULUM) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        read(extra, text)
    message = str(caught.value)
    assert message.isascii()
    assert all(len(line) < 500 for line in message.splitlines())
    return [str(problem) for problem in caught.value.problems]


def replaced(old: str, new: str) -> str:
    assert old in PENDULUM
    return PENDULUM.replace(old, new)


FREE = """\
format = 1
name = "satellite"
[bodies.hull]
mass = 10
inertia = [[2, 0.1, 0], [0.1, 3, 0], [0, 0, 4]]
[joints.flight]
type = "free"
parent = "base"
child = "hull"
"""


def test_free_joint_state() -> None:
    scene = read('initial = { position = [1, 2, 3], rotation = [{ axis = [0, 0, 1], angle = "pi/2" }] }', FREE)
    half = math.sqrt(0.5)
    assert scene.joints[0].initial_position == pytest.approx((half, 0, 0, half, 1, 2, 3), abs=1e-15)
    assert scene.joints[0].initial_velocity == (0.0,) * 6
    assert scene.bodies[0].inertia[3] == Number(0.1)
    scene = read("initial = { orientation = [0, -1.0000001, 0, 0], velocity = [1, 2, 3, 4, 5, 6] }", FREE)
    assert scene.joints[0].initial_position == (0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert scene.joints[0].initial_velocity == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@pytest.mark.parametrize(
    ("quaternion", "message"),
    [
        ("[0, 2, 0, 0]", "the quaternion has norm 2, not 1; try: [0, 1, 0, 0]"),
    ],
)
def test_quaternions_of_other_norms_are_refused(quaternion: str, message: str) -> None:
    assert problems(f"initial = {{ orientation = {quaternion} }}", FREE) == [
        f"scene.toml:10 (joints.flight.initial.orientation): {message}"
    ]


def test_intrinsic_rotations_agree_as_matrix_and_quaternion() -> None:
    turns = (
        "[{ axis = [1, 2, 3], angle = 0.7 }, { axis = [0, -1, 1], angle = -1.3 }, { axis = [1, 0, 0], angle = 2.1 }]"
    )
    joint = read(f"rotation = {turns}\ninitial = {{ rotation = {turns} }}", FREE).joints[0]
    w, x, y, z = joint.initial_position[:4]
    expected = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    np.testing.assert_allclose(joint.orientation, expected, atol=1e-15)


def test_axis_is_normalised_and_snapped() -> None:
    assert read(text=replaced("[0, 1, 0]", "[0, -3e-11, -2]")).joints[0].axis == (0.0, 0.0, -1.0)
    assert read(text=replaced("[0, 1, 0]", "[3, 0, 4]")).joints[0].axis == pytest.approx((0.6, 0.0, 0.8))


def test_right_angles_are_exact() -> None:
    joint = read("rotation = [{ axis = [0, 0, 1], angle = 1.57079632679 }]").joints[0]
    assert joint.orientation == ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def test_parents_come_first_and_order_is_kept_otherwise() -> None:
    bodies = "".join(f"[bodies.{name}]\nmass = 1\ninertia = [1, 1, 1]\n" for name in "abcde")
    pairs = [("d", "c"), ("c", "a"), ("e", "base"), ("a", "base"), ("b", "e")]
    joints = "".join(
        f'[joints.to_{child}]\ntype = "revolute"\nparent = "{parent}"\nchild = "{child}"\naxis = [0, 0, 1]\n'
        for child, parent in pairs
    )
    scene = read(text=f'format = 1\nname = "tree"\n{bodies}{joints}')
    assert [joint.child for joint in scene.joints] == ["e", "a", "c", "d", "b"]
    assert [body.name for body in scene.bodies] == ["e", "a", "c", "d", "b"]


def test_a_digest_determines_the_scene() -> None:
    assert read().digest == read("# a comment\n").digest
    assert read().digest == read(text=replaced("[0, 1, 0]", "[0, 1.0, 0.0]")).digest
    assert read().digest != read(text=replaced("0.8", "0.9")).digest


def test_byte_order_mark_and_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "pendulum.TOML"
    path.write_bytes(b"\xef\xbb\xbf" + PENDULUM.replace("\n", "\r\n").encode())
    scene = load(path)
    assert scene.name == "pendulum"
    assert scene.source["joints.hinge.axis"] == "pendulum.TOML:14"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a = [\n [1]\n [2]]\n", "scene.toml:3: this is not TOML: Unclosed array (column 2)"),
        (b"b = 1\na = [1, 2\n", "scene.toml:2: this is not TOML: Unclosed array (at end of document); try: a ] at"),
        (b"a = 1\na = 2\n", "scene.toml:2: this is not TOML: the key a is given twice; try: one of them"),
        (b"a = " + b"[" * 5000, "scene.toml: lists or tables are nested too deep"),
    ],
)
def test_files_that_are_not_toml(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(DescriptionError) as caught:
        load(path)
    assert message in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"missing\.toml': cannot be read: No such file or directory"):
        load(tmp_path / "missing.toml")
    with pytest.raises(
        UsageError, match=r"is not a kind of file that can be read; try: a \.toml scene, a \.urdf file, an"
    ):
        load(tmp_path / "scene.json")
    with pytest.raises(UsageError, match="xacro first"):
        load(tmp_path / "robot.xacro")
    with pytest.raises(
        UsageError, match="root, lock, limits, friction, actuated, transmissions and tunable are for URDF only"
    ):
        load(tmp_path / "scene.toml", lock=["hinge"])
    with pytest.raises(FileError, match="cannot be read"):
        load(tmp_path / "nul\0.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(FileError, match="Is a directory"):
        load(tmp_path / "folder.toml")
    (tmp_path / "large.toml").write_bytes(b"#" * 10_000_001)
    with pytest.raises(FileError, match=r"large\.toml: the file is larger than 10 MB"):
        load(tmp_path / "large.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format = 1", "format = 2", "scene.toml:1 (format): this eomgen reads format 1, not 2"),
        ('"2*length"', '"1/(length - 0.8)"', "at the default parameters, div(1, 0) has no finite value"),
        ("[0.1, 0.1, 0.01]", "[0.1, 0.1]", "scene.toml:9 (bodies.link.inertia): an inertia is needed here"),
        ("[0.1, 0.1, 0.01]", "{ xx = 1, yy = 1, zz = 1, yx = 0 }", "where needed: 'yx' is unknown"),
        ("[0.1, 0.1, 0.01]", "[[1, 0, 0], [1, 1, 0], [0, 0, 1]]", "the inertia matrix is not symmetric in [0][1]"),
        ('"revolute"', '"fixed"', "scene.toml:14 (joints.hinge.axis): a fixed joint has no axis"),
        ('parent = "base"', 'parent = "link"', "the joint connects the body link to itself"),
    ],
)
def test_one_problem(old: str, new: str, message: str) -> None:
    found = problems(text=replaced(old, new))
    assert any(message in problem for problem in found), found
    assert all(problem.startswith("scene.toml") for problem in found)


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (
            "orientation = [[1, 0.3, 0], [0, 1, 0], [0, 0, 1]]",
            "(joints.hinge.orientation): the matrix is not a rotation",
        ),
        (
            'rotor_inertia = "-length"',
            "(joints.hinge.rotor_inertia): the rotor inertia -0.8 is negative; try: 0 or more",
        ),
        ("initial = { orientation = [1, 0, 0, 0] }", "a revolute joint has no initial orientation; try: position"),
        ('[outputs]\nend = { position = "link" }', "(outputs.end.position): link is a body, not a point"),
        (
            '[points]\na = { body = "link" }\n[springs]\ns = { first = "a", second = "a" }',
            "connects the point a to itself",
        ),
        (
            "[outputs]\no = {}",
            "an output needs one of position, velocity, acceleration, reaction_force, reaction_moment, section_force,"
            " section_moment, section_strain, section_curvature, formula, energy, not none",
        ),
        ("[outputs]\no = { formula = [] }", "the list of formulas is empty"),
        ("[simulation]\nstep = 0", "scene.toml:16 (simulation.step): the step 0 is not positive; try: 1e-3"),
        ("[simulation]\nduration = -0.1", "the duration -0.1 is negative"),
        ("[simulation]\nrecord_every = 0", "(simulation.record_every): 0 is out of range here: it should be greater"),
        ("[bodies.base]\nmass = 1", "the name base is reserved for the frame that carries the tree"),
    ],
)
def test_one_problem_added(extra: str, message: str) -> None:
    found = problems(extra)
    assert any(message in problem for problem in found), found


def test_all_problems_at_once_in_the_order_of_lines() -> None:
    text = PENDULUM.replace("0.8", "true").replace("[0, 1, 0]", "[0, 0, 0]").replace('"base"', '"bas"')
    found = problems('[points]\ntip = { body = "lin" }\n[simulation]\nstep = -1\nduratoin = 1', text)
    assert [problem.split(": ")[0] for problem in found] == [
        "scene.toml:4 (parameters.length.value)",
        "scene.toml:12 (joints.hinge.parent)",
        "scene.toml:14 (joints.hinge.axis)",
        "scene.toml:16 (points.tip.body)",
        "scene.toml:19 (simulation.duratoin)",
    ]
    with pytest.raises(
        DescriptionError, match=r"(?s)^description error: 5 problems\n  1\. scene\.toml:4 .*\n  5\. scene\.toml:19"
    ):
        read('[points]\ntip = { body = "lin" }\n[simulation]\nstep = -1\nduratoin = 1', text)


def test_a_broken_entry_causes_no_second_problem() -> None:
    extra = '[efforts]\ne = { joint = "hinge", effort = "v.hinge[0] + length" }\n[outputs]\no = { formula = "q.hinge" }'
    text = PENDULUM.replace('"revolute"', '"hing"').replace("0.8", "[]")
    assert [problem.split(": ")[0] for problem in problems(extra, text)] == [
        "scene.toml:4 (parameters.length.value)",
        "scene.toml:11 (joints.hinge.type)",
    ]


def test_a_misspelt_key_or_child_is_one_problem() -> None:
    assert problems("", replaced("child =", "chlid =")) == [
        "scene.toml:13 (joints.hinge.chlid): the key 'chlid' is unknown here; try: child"
    ]
    second = '[bodies.tip]\nmass = 1\n[joints.second]\ntype = "fixed"\nparent = "link"\nchild = "tip"\n'
    assert problems(second, replaced('child = "link"', 'child = "lnk"')) == [
        "scene.toml:13 (joints.hinge.child): there is no body 'lnk'; try: link"
    ]
    found = problems(f"{second}[bodies.lost]\nmass = 1", replaced('child = "link"', 'child = "lnk"'))
    assert [problem.partition("): ")[2] for problem in found] == [
        'no joint carries the body link, nor the bodies that hang from it: tip; try: a joint with child = "link"',
        "there is no body 'lnk'; try: link",
        'no joint carries the body lost; try: a joint with child = "lost"',
    ]


def test_cycles_and_what_hangs_from_them() -> None:
    bodies = "".join(f"[bodies.{name}]\nmass = 1\ninertia = [1, 1, 1]\n" for name in "abcde")
    pairs = [("a", "b"), ("b", "c"), ("c", "a"), ("d", "c"), ("link2", "e")]
    joints = "".join(
        f'[joints.to_{child}]\ntype = "revolute"\nparent = "{parent}"\nchild = "{child}"\naxis = [0, 0, 1]\n'
        for child, parent in pairs
    )
    found = problems(f"{bodies}[bodies.link2]\nmass = 1\n{joints}")
    assert [problem.split(": ", 1)[1].split(";")[0] for problem in found] == [
        "no joint carries the body e, nor the bodies that hang from it: link2",
        "the joints carry the bodies c, b, a in a circle",
    ]


def chain(*links: str) -> str:
    """Return a scene of joints ``type mass inertia`` in a row; the last number is the rotor's."""
    text = 'format = 1\nname = "chain"\n'
    for number, link in enumerate(links):
        kind, mass, inertia, rotor = link.split()
        text += (
            f"[bodies.b{number}]\nmass = {mass}\ncenter_of_mass = [0, 0, -1]\ninertia = [{', '.join([inertia] * 3)}]\n"
        )
        text += (
            f'[joints.j{number}]\ntype = "{kind}"\nparent = "{f"b{number - 1}" if number else "base"}"\nchild ='
            f' "b{number}"\n'
        )
        if kind in ("revolute", "prismatic"):
            text += f"axis = [0, 0, 1]\nrotor_inertia = {rotor}\n"
    return text


@pytest.mark.parametrize(
    ("links", "message"),
    [
        (["revolute 0 0 0"], "the joint j0 cannot be moved by a force: it carries neither mass nor inertia"),
        (["revolute 1 1 0", "revolute 0 0 0"], "(joints.j1): the joint j1 cannot be moved by a force"),
        (["revolute 1 0 0"], "the bodies that it carries lack inertia about its axis"),
        (["prismatic 0 1 0"], "the bodies that it carries lack mass"),
        (["spherical 1 0 0"], "the bodies that it carries lack inertia about some axis"),
        (["free 1 0 0"], "the bodies that it carries lack mass, or inertia about some axis"),
        (["fixed 1 1 0"], "no joint can move; try: a revolute, prismatic, spherical or free joint"),
    ],
)
def test_joints_that_move_nothing(links: list[str], message: str) -> None:
    (found,) = problems(text=chain(*links))
    assert message in found


@pytest.mark.parametrize(
    "links",
    [
        ["revolute 0 0 1"],
        ["prismatic 0 0 1"],
        ["revolute 0 0 0", "revolute 1 1 0"],
        ["revolute 0 0 0", "fixed 0 1 0"],
        ["revolute 0 0 0", "fixed 0 0 0", "prismatic 1 0 0"],
        ["prismatic 1 0 0"],
        ["spherical 1 1 0"],
    ],
)
def test_massless_bodies_on_the_way_are_allowed(links: list[str]) -> None:
    assert len(read(text=chain(*links)).joints) == len(links)


def test_empty_scene() -> None:
    assert problems(text='format = 1\nname = "nothing"\n') == [
        "scene.toml (joints): no joint can move; try: a revolute, prismatic, spherical or free joint"
    ]


HOSTILE = ["*/", "{{7*7}}", '"; rm -rf', "../x", "p\u0430rt", "a\nb", "x" * 10_000, "", "a.b", "a]b", "%s", "\x1b[31m"]
HOSTILE += ["1a", "int main", "a'b"]


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names(name: str) -> None:
    quoted = json.dumps(name)
    for text in (
        replaced('"pendulum"', quoted),
        replaced("[bodies.link]", f"[bodies.{quoted}]").replace('"link"', quoted),
        replaced("[joints.hinge]", f"[joints.{quoted}]"),
        replaced("length = 0.8", f"length = 0.8\n{quoted} = 1"),
        f"{PENDULUM}[points]\n{quoted} = {{ body = 'link' }}",
        f"{PENDULUM}[outputs]\n{quoted} = {{ energy = 'total' }}",
    ):
        (found,) = problems(text=text)
        assert "is not legal; try: up to 64 ASCII letters, digits and underscores, no digit first" in found
        assert "\n" not in found
        assert len(found) < 300
        assert found.startswith("scene.toml:")


@pytest.mark.slow_except("*/", "1a", "int main")
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_references(name: str) -> None:
    quoted = json.dumps(name)
    for text in (
        replaced('parent = "base"', f"parent = {quoted}"),
        replaced('child = "link"', f"child = {quoted}"),
        f"{PENDULUM}[points]\ntip = {{ body = {quoted} }}",
        f"{PENDULUM}[springs]\ns = {{ first = {quoted}, second = {quoted} }}",
        f"{PENDULUM}[torsion_springs]\ns = {{ first = {quoted}, second = {quoted} }}",
        f"{PENDULUM}[outputs]\no = {{ velocity = {quoted} }}",
        f"{PENDULUM}[outputs]\no = {{ {quoted} = 1 }}",
        f"{PENDULUM}[{quoted}]",
        replaced('"revolute"', quoted),
        f"{PENDULUM}[simulation]\nmethod = {quoted}",
        replaced("format = 1", f"format = 1\nterms = [{quoted}]"),
    ):
        assert all("\n" not in problem and len(problem) < 400 for problem in problems(text=text))


@pytest.mark.slow
def test_hostile_sizes_end_soon() -> None:
    count = 5_000
    chain_away = "".join(f'[joints.j{n}]\ntype = "fixed"\nparent = "b{n + 1}"\nchild = "b{n}"\n' for n in range(count))
    bodies = "".join(f"[bodies.b{n}]\nmass = 1\n" for n in range(count + 1))
    found = problems(bodies + chain_away)
    assert len(found) == 1
    assert f"no joint carries the body b{count}, nor the bodies that hang from it: b0, b1, b2," in found[0]
    unknown = "".join(f'[points.p{n}]\nbody = "b{n}"\n' for n in range(count))
    found = problems(unknown)
    assert len(found) == 101
    assert found[100].endswith("900 more problems are not listed; try: the first ones repaired")


def test_line_index() -> None:
    text = '''\
# comment [x]
a . "b c" = """
[not.a.table]
k = 1 \\""" """ # done
list = [ # first
  1,
  { x = 1, y.z = [2,
    3] }, ']', "]" ]
['q"']
'' = 1
[deep.er]
v = -1e5 # =
w = \'\'\'a\'b\'\'\'
[[rows]]
s = "x\\"#"
'''
    index = line_index(text.replace("\n", "\r\n"))
    lines = {line: " ".join(key for key, at in index.items() if at == line) for line in sorted({*index.values()})}
    assert lines == {
        2: "a a.'b c'",
        5: "list",
        6: "list[0]",
        7: "list[1] list[1].x list[1].y list[1].y.z list[1].y.z[0]",
        8: "list[1].y.z[1] list[2] list[3]",
        9: "'q\"'",
        10: "'q\"'.''",
        11: "deep deep.er",
        12: "deep.er.v",
        13: "deep.er.w",
        14: "rows",
        15: "rows.s",
    }


def test_line_index_counts_entries_without_a_line() -> None:
    """Numbers, pairs of numbers and comments from the 17th entry on stand before entries with a line."""
    numbers = ", ".join(map(str, range(20)))
    pairs = ", ".join(f"[{k}, 0]" for k in range(18))
    index = line_index(f"a = [{numbers},\n{{ x = 1 }}, 21 # 21, 22\n, 22, # [23\n23, 'text',\n{{ y = 1 }}]\n")
    found = {key: line for key, line in index.items() if key.startswith("a[2")}
    assert found == {"a[2]": 1, "a[20]": 2, "a[20].x": 2, "a[25]": 5, "a[25].y": 5}
    index = line_index(f"b = [{pairs}, [[1, 2], [3, 4]], 5,\n{{ x = 1 }},]")
    assert index["b[20].x"] == 2


def test_terms_are_chosen_by_name() -> None:
    assert read(text=replaced("format = 1", 'format = 1\nterms = ["mass", "poses", "mass"]')).terms == ("mass", "poses")
    (found,) = problems(text=replaced("format = 1", 'format = 1\nterms = ["mas"]'))
    assert found == "scene.toml:2 (terms[0]): 'mas' is not known here; try: mass"


@pytest.mark.slow
def test_the_scene_needs_no_pydantic() -> None:
    program = "import sys, eomgen.scene.scene, eomgen.scene.load; print('pydantic' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
