"""Included files: the scene that they make is the one written by hand, and every message points into the right file."""

from __future__ import annotations

import ast
import copy
import dataclasses
import functools
import itertools
import operator
import re
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eomgen
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.document.schema import every_document, section_keys
from eomgen.scene.formula.scope import SceneNames
from eomgen.scene.load import from_data, load, load_toml
from eomgen.scene.reading.key_metadata import fields_of, tables_of
from eomgen.scene.scene import Scene
from tests.models import library
from tests.models.urdf import FILES, ROBOTS
from tests.oracles.evaluation import tape_evaluator

DOCUMENT = every_document()
SECTIONS = section_keys()

WHEEL = Path(library.__file__).with_name("wheel.toml").read_text(encoding="utf-8")
CAR = """\
format = 1
name = "car"
[parameters]
spring_rate = { value = "25 kN/m", unit = "N/m", tunable = true }
[bodies.chassis]
mass = 400
inertia = [100, 110, 120]
[joints.heave]
type = "prismatic"
parent = "base"
child = "chassis"
axis = [0, 0, 1]
"""
LEFT = """\
[include.left]
file = "wheel.toml"
parent = "chassis"
position = [0, "0.7 m", 0]
rotation = [{ axis = [1, 0, 0], angle = "10 deg" }]
parameters = { stiffness = "spring_rate", mass = "25 kg" }
"""
RIGHT = """\
[include.right]
file = "wheel.toml"
prefix = "r_"
parent = "chassis"
"""
#: What LEFT makes of WHEEL, written by hand.
BY_HAND = """\
[parameters.left_mass]
value = 25
unit = "kg"
[parameters.left_rest]
value = 0.3
unit = "m"
[curves]
left_bump = { bump = { length = 0.4, height = 0.05 } }
[inputs]
left_push = { formula = "0.1 * left_mass * sin(t) + left_bump(t)", unit = "N" }
[bodies.left_base]
mass = 0
[bodies.left_hub]
mass = "left_mass"
[joints.left_base]
type = "fixed"
parent = "chassis"
child = "left_base"
position = [0, 0.7, 0]
rotation = [{ axis = [1, 0, 0], angle = "10 * pi / 180" }]
[joints.left_travel]
type = "prismatic"
parent = "left_base"
child = "left_hub"
axis = [0, 0, 1]
position = [0, 0, "-left_rest"]
damping = "2 * sqrt(spring_rate * left_mass)"
[points.left_top]
body = "left_base"
[points.left_center]
body = "left_hub"
[springs.left_coil]
first = "left_top"
second = "left_center"
stiffness = "spring_rate"
length = "left_rest"
[efforts.left_push]
joint = "left_travel"
effort = "left_push - 0.1 * v.left_travel * velocity.left_center[2] * (t > 1)"
[outputs]
left_height = { formula = ["position.left_center[2]", "0.5 * tension.left_coil + energy.total"] }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "wheel.toml").write_text(WHEEL, encoding="utf-8")
    return tmp_path


def made(folder: Path, text: str, name: str = "car.toml") -> Scene:
    (folder / name).write_text(text, encoding="utf-8")
    return load(folder / name)


def problems(folder: Path, text: str, name: str = "car.toml") -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        made(folder, text, name)
    assert str(caught.value).isascii()
    return [str(problem) for problem in caught.value.problems]


# -- the scene that is made --------------------------------------------------------------------------------------------


def test_an_include_is_what_would_be_written_by_hand(folder: Path) -> None:
    found, expected = made(folder, CAR + LEFT), load_toml(CAR + BY_HAND)
    for field in dataclasses.fields(Scene):
        if field.name not in ("content", "source", "notes", "joints", "requirements"):
            assert repr(getattr(found, field.name)) == repr(getattr(expected, field.name)), field.name  # arrays too
    for mine, theirs in zip(found.joints, expected.joints, strict=True):
        np.testing.assert_allclose(mine.orientation, theirs.orientation, atol=1e-15)
        assert dataclasses.replace(mine, orientation=theirs.orientation) == theirs


def test_without_a_place_the_parent_itself_is_the_base(folder: Path) -> None:
    scene = made(folder, CAR + RIGHT)
    assert [body.name for body in scene.bodies] == ["chassis", "r_hub"]
    assert scene.joints[1].parent == "chassis" and scene.points[0].body == "chassis"
    assert [item.name for item in scene.parameters] == ["spring_rate", "r_stiffness", "r_mass", "r_rest"]
    assert scene.parameters[1].tunable and not scene.parameters[2].tunable
    left = {item.name: (item.value, item.unit) for item in made(folder, CAR + LEFT).parameters}
    assert (left["left_mass"], left["left_rest"]) == ((25.0, "kg"), (0.3, "m"))


def test_twice_the_same_file(folder: Path) -> None:
    scene = made(folder, CAR + LEFT + RIGHT + '[outputs]\nboth = { formula = "q.left_travel - q.r_travel" }\n')
    assert [joint.name for joint in scene.joints] == ["heave", "left_base", "left_travel", "r_travel"]
    assert [item.name for item in scene.outputs] == ["both", "left_height", "r_height"]
    assert scene.source["springs.left_coil.stiffness"] == scene.source["springs.r_coil.stiffness"] == "wheel.toml:28"
    assert scene.source["joints.left_base.position"] == "car.toml:16"
    left_out = [note for note in scene.notes if "gravity" in note]
    assert left_out == ["wheel.toml: its key gravity is left out, the key of the including scene holds"]


def test_doubts_of_a_part_are_left_out_with_a_note(folder: Path) -> None:
    with (folder / "wheel.toml").open("a", encoding="utf-8") as file:
        file.write('[doubts]\nquiet = ["unused names"]\nstrict = true\n')
    notes = made(folder, CAR + LEFT).notes
    assert "wheel.toml: its key doubts is left out, the key of the including scene holds" in notes


def test_includes_within_includes(folder: Path) -> None:
    (folder / "axles").mkdir()
    axle = library.scene_text(
        "pendulum",
        outputs=None,
        parameters={"rate": 1000, "load": 2},
        include={
            "end": {
                "file": "../wheel.toml",
                "parent": "rod",
                "position": [0, "load", 0],
                "parameters": {"stiffness": "2 * rate", "mass": "load"},
            }
        },
    )
    (folder / "axles" / "axle.toml").write_text(axle, encoding="utf-8")
    text = '[include.front]\nfile = "axles/axle.toml"\nparameters = { rate = "spring_rate / 2", load = 3 }\n'
    scene = made(folder, CAR + text)
    assert [body.name for body in scene.bodies] == ["chassis", "front_rod", "front_end_base", "front_end_hub"]
    assert {item.name for item in scene.parameters} == {"spring_rate", "front_load", "front_end_rest"}
    parameters = {"spring_rate": {"value": 1, "tunable": True}, "front_load": 3}
    changes = {"stiffness": "2 * (spring_rate / 2)", "rest": "front_load"}
    by_hand = from_data(
        library.scene("oscillator", parameters=parameters, **{f"joints__slide__{k}": v for k, v in changes.items()})
    ).joints[0]
    assert scene.springs[0].stiffness == by_hand.stiffness
    assert scene.joints[2].position[1] == scene.bodies[3].mass == by_hand.rest
    assert scene.source["joints.front_end_travel"] == "wheel.toml:14"
    assert scene.source["joints.front_hinge"] == "axles/axle.toml:4"


TWICE = '[definitions]\ntwice = "{}"\n[outputs.two]\nformula = "twice"\n'


def test_a_parameter_of_a_part_of_a_part_takes_a_formula(folder: Path) -> None:
    (folder / "wheel.toml").write_text(WHEEL + TWICE.format("2 * rest"), encoding="utf-8")
    axle = library.scene_text("pendulum", outputs=None, include={"end": {"file": "wheel.toml", "parent": "rod"}})
    (folder / "axle.toml").write_text(axle, encoding="utf-8")
    text = '[include.front]\nfile = "axle.toml"\nparameters = { end_rest = "spring_rate / 1e5" }\n'
    by_hand = load_toml(CAR + TWICE.format("2 * (spring_rate / 1e5)")).outputs[0]
    found = next(item for item in made(folder, CAR + text).outputs if item.name == "front_end_two")
    assert found.values == by_hand.values


def test_references_and_frames_are_renamed(folder: Path) -> None:
    """An arm whose efforts follow its own reference, and a spring on a frame of it, twice in one scene."""
    library.scene_file(
        folder,
        "pendulum",
        outputs=None,
        frames={"tool": {"body": "rod", "position": [0.5, 0, 0]}},
        points={"wall": {"body": "base"}},
        springs={"coil": {"first": "wall", "second": "tool", "stiffness": 10}},
        references={"servo": {"acceleration": {"hinge": "position.tool[2] - v.hinge"}}},
        efforts={"motor": {"joint": "hinge", "effort": "tau.hinge(servo) + gravity.hinge"}},
    )
    both = "".join(f'[include.{side}]\nfile = "pendulum.toml"\n' for side in ("left", "right"))
    scene = made(folder, f'format = 1\nname = "both"\n{both}')
    assert [frame.name for frame in scene.frames] == ["left_tool", "right_tool"]
    assert {frame.body for frame in scene.frames} == {"left_rod", "right_rod"}
    twice, once = derive(scene, ["forward_dynamics"]), derive(load(folder / "pendulum.toml"), ["forward_dynamics"])
    q, v = np.array([0.4, -1.1]), np.array([0.2, 0.7])
    found = tape_evaluator(twice)("forward_dynamics", {"q": q, "v": v})["vdot"]
    for k in range(2):
        alone = tape_evaluator(once)("forward_dynamics", {"q": q[k : k + 1], "v": v[k : k + 1]})["vdot"]
        np.testing.assert_allclose(found[k], alone[0], rtol=1e-13)


def test_tables_are_found_from_the_file_that_names_them(folder: Path) -> None:
    (folder / "parts").mkdir()
    (folder / "parts" / "bumps.csv").write_text("x,y\n0,0\n1,0.5\n2,0\n", encoding="utf-8")
    part = WHEEL.replace(
        "bump = { bump = { length = 0.4, height = 0.05 } }", 'bump = { table = { file = "bumps.csv" } }'
    )
    (folder / "parts" / "part.toml").write_text(part, encoding="utf-8")
    scene = made(folder, CAR + '[include.a]\nfile = "parts/part.toml"\n')
    assert [curve.name for curve in scene.curves] == ["a_bump"]
    (folder / "parts" / "bumps.csv").write_text("x,y\n0,0\n1,0.6\n2,0\n", encoding="utf-8")
    assert load(folder / "car.toml").digest != scene.digest


def test_the_cache_sees_what_is_in_included_files(folder: Path) -> None:
    first = made(folder, CAR + LEFT).digest
    assert made(folder, CAR + LEFT + "# a comment\n").digest == first
    (folder / "wheel.toml").write_text(WHEEL.replace("0.1 * mass", "0.2 * mass"), encoding="utf-8")
    second = load(folder / "car.toml").digest
    (folder / "wheel.toml").write_text(WHEEL, encoding="utf-8")
    third = made(folder, CAR + LEFT.replace('stiffness = "spring_rate"', 'stiffness = "2 * spring_rate"')).digest
    assert len({first, second, third}) == 3


def test_a_builder_includes_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    builder = eomgen.SceneBuilder("car").parameter("spring_rate", "25 kN/m", unit="N/m", tunable=True)
    builder.body("chassis", mass=400, inertia=[100, 110, 120])
    builder.joint("heave", "prismatic", "base", "chassis", axis=[0, 0, 1])
    keys: Any = {"parent": "chassis", "position": [0, "0.7 m", 0], "rotation": [([1, 0, 0], "10 deg")]}
    builder.include("left", "wheel.toml", **keys, parameters={"stiffness": "spring_rate", "mass": "25 kg"})
    found, expected = builder.build(), made(folder, CAR + LEFT)
    assert (found.joints, found.springs, found.parameters) == (expected.joints, expected.springs, expected.parameters)
    builder.include("left", "wheel.toml")
    with pytest.raises(DescriptionError, match=r"test_include\.py:\d+ \(include\.left\): this was given before"):
        builder.build()


EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.toml"))


FIRST = ["active_vehicle", "elastic_vehicle", "sea_arm", "four_bar", "gear_with_backlash", "jerk_limited_arm"]


def check_included(path: Path) -> None:
    """Check that the scene of a file is the same when it is included: the prefix is taken away again."""
    expected, data = load(path), tomllib.loads(path.read_text(encoding="utf-8"))
    own = {key: value for key, value in data.items() if key not in SECTIONS and key != "repeat"}
    own |= {"include": {"part": {"file": path.name, "prefix": "zz_"}}, "parameters": {}}
    # they may use the file's parameters, so they are written in the new names
    for key in own.keys() & {"base", "gravity"}:
        text = repr(own[key])
        for name in data.get("parameters", {}):
            text = re.sub(rf"\b{name}\b", f"zz_{name}", text)
        own[key] = ast.literal_eval(text)
    found = from_data(own, folder=path.parent)
    for field in dataclasses.fields(Scene):
        if field.name not in ("content", "source", "notes", "metadata"):
            assert repr(getattr(found, field.name)).replace("zz_", "") == repr(getattr(expected, field.name)), (
                field.name
            )


@pytest.mark.slow_except("heavy_top/r3xso3", *(f"{name}/scene" for name in FIRST))
@pytest.mark.long_cases("cable_net/scene")
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_example_is_itself_when_it_is_included(path: Path) -> None:
    """Whatever sections and kinds of formulas there are."""
    check_included(path)


def test_resets_and_repeated_entries_of_a_part(tmp_path: Path) -> None:
    resets = {"v.ball": "-restitution * v.ball", "hits": "hits + 1"}
    bounce = {"when": "q.ball", "direction": "falling", "action": "reset", "reset": resets}
    rows = {"row": {"indices": {"i": 2}, "points": {"top_{i}": {"body": "ball", "position": [0, 0, "0.1 * {i}"]}}}}
    states = {"hits": {"rate": 0}}
    check_included(library.scene_file(tmp_path, "bouncing_ball", events__bounce=bounce, repeat=rows, states=states))


# -- robots ------------------------------------------------------------------------------------------------------------

PLATFORM = """\
format = 1
name = "mobile"
[bodies.platform]
mass = 120
inertia = [10, 20, 30]
[joints.drive]
type = "prismatic"
parent = "base"
child = "platform"
axis = [1, 0, 0]
[include.arm]
file = "robot.urdf"
parent = "platform"
position = ["100 mm", 0.2, 0.3]
rotation = [{ axis = [0, 0, 1], angle = 0.4 }, { axis = [0, 1, 0], angle = 0.3 }, { axis = [1, 0, 0], angle = -0.2 }]
"""


def test_options_of_a_robot(folder: Path) -> None:
    (folder / "robot.urdf").write_text((ROBOTS / FILES["panda"]).read_text(encoding="utf-8"), encoding="utf-8")
    options = 'lock = ["panda_finger_joint1", "panda_finger_joint2"]\nroot = "free"\nlimits = true\n'
    scene = made(folder, PLATFORM + options)
    assert sum(len(joint.stops) for joint in scene.joints) == 7
    assert [joint.type for joint in scene.joints].count("revolute") == 7
    roots = [(joint.name, joint.parent) for joint in scene.joints if joint.type == "free"]
    assert roots == [("arm_root_joint", "arm_base")]
    assert any(note.startswith("robot.urdf: joints locked at zero: panda_finger_joint1") for note in scene.notes)
    [found] = problems(folder, PLATFORM + 'lock = ["panda_finger"]\n')
    fault = "robot.urdf has no joint 'panda_finger' to lock; try: panda_finger"
    assert found.startswith(f"car.toml:16 (include.arm.lock): {fault}")
    [found] = problems(folder, PLATFORM + "parameters = { mass = 3 }\n")
    assert found.startswith(
        "car.toml:16 (include.arm.parameters.mass): 'robot.urdf' has no parameter 'mass'; try: without"
    )


# -- messages ----------------------------------------------------------------------------------------------------------


FILE = '"wheel.toml"'
RATE = '"spring_rate"'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (FILE, '"whel.toml"', "14 (include.left.file): 'whel.toml' cannot be read: No such file or directory; try: a"),
        (FILE, '"."', "14 (include.left.file): '.' is not a kind of file that can be included; try: a .toml scene, a"),
        (FILE, '"a\\u0000.toml"', "14 (include.left.file): 'a\\x00.toml' is not a path"),
        ('"chassis"', '"chasis"', "15 (include.left.parent): there is no body 'chasis'; try: chassis"),
        (RATE, '"25 kN"', "18 (include.left.parameters.stiffness): '25 kN' is a force, a stiffness in N/m is"),
        (RATE, '"spring_rat"', "18 (include.left.parameters.stiffness): unknown name 'spring_rat' (column 1); try: sp"),
        ("parent", "initial.slide.position = 1\nparent", "15 (include.left.initial.slide): 'wheel.toml' has no joint"),
        ("parent", 'prefix = "9 x"\nparent', "13 (include.left): '9 x' cannot be the beginning of a name; try"),
    ],
)
def test_what_is_wrong_with_an_include(folder: Path, old: str, new: str, message: str) -> None:
    found = problems(folder, CAR + LEFT.replace(old, new, 1))
    assert found[0].startswith(f"car.toml:{message}")
    assert len(found) == 1 or "fil" in new


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[points.top]", "[points.'a b']", "21 (points.'a b'): the name 'a b' is not legal; try: up to 64"),
        ("format = 1", "format = 1\nbodies", "2: this is not TOML: Expected '=' after a key"),
    ],
)
def test_what_is_wrong_in_an_included_file(folder: Path, old: str, new: str, message: str) -> None:
    (folder / "wheel.toml").write_text(WHEEL.replace(old, new, 1), encoding="utf-8")
    assert problems(folder, CAR + LEFT)[0].startswith(f"wheel.toml:{message}")


def test_circles_are_named(folder: Path) -> None:
    for one, other in itertools.pairwise(("a.toml", "b.toml", "c.toml", "a.toml")):
        (folder / one).write_text(f'format = 1\nname = "x"\n[include.next]\nfile = "{other}"\n', encoding="utf-8")
    [found] = problems(folder, CAR + '[include.first]\nfile = "a.toml"\n')
    fault = "c.toml:4 (include.next.file): files include one another in a circle: a.toml, b.toml, c.toml, a.toml; try"
    assert found.startswith(fault)


def test_includes_without_end_are_refused(folder: Path) -> None:
    for number in range(25):
        text = "".join(f'[include.{name}]\nfile = "{number + 1}.toml"\n' for name in "ab")
        (folder / f"{number}.toml").write_text(f'format = 1\nname = "x"\n{text}', encoding="utf-8")
    found = problems(folder, CAR + '[include.first]\nfile = "0.toml"\n')
    assert "more than 1000 files, or more than 20 within one another, are included; try: fewer of them" in found[0]


def test_names_given_twice_are_named_with_both_places(folder: Path) -> None:
    clash = CAR + RIGHT + '[points.r_top]\nbody = "chassis"\n[include.other]\nfile = "wheel.toml"\nprefix = "r_"\n'
    found = problems(folder, clash)
    twice = "car.toml:13 (include.right): the name r_top in points is given twice, at car.toml:17 and at wheel.toml:21"
    assert found[0] == f'{twice}; try: another prefix than "r_"'
    twice = "car.toml:19 (include.other): the name r_stiffness in parameters is given twice, at wheel.toml:5 and at"
    assert found[1].startswith(twice)
    plain = CAR + RIGHT.replace('"r_"', '""') + "[inputs]\nmass = {}\n"
    both = "car.toml:18 (inputs.mass): the name mass is both a parameter and an input"
    assert problems(folder, plain)[0].startswith(both)


def test_the_section_is_a_table(folder: Path) -> None:
    text = CAR.replace('name = "car"', 'name = "car"\ninclude = "wheel.toml"')
    assert problems(folder, text) == [
        "car.toml:3 (include): a table is needed here, not 'wheel.toml'; try: [include.left] and file = \"left.toml\""
    ]


_WORDS = ["x", "stiffness", "base", "world", "left_hub"]
_TEXTS = ["", *_WORDS, "2 * t", "3 mm", "3 if", "1e400", "wheel.toml", "\u00e9", "a" * 70, "\0"]
_VALUES: list[Any] = [3, -1.5, True, None, [], {}, [1, 2, 3], [[1]], {"a": 1}, float("nan"), 10**400]
_ODD = st.sampled_from([*_TEXTS, *_VALUES, ["250 mm", 0, "q.travel"]])
_NAMES = st.sampled_from(["\u00e9", "a b", "x", "base", "t", "", "kind", "include"])


def _places(data: Any, place: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    for key, entry in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield (*place, key)
        yield from _places(entry, (*place, key))


@st.composite
def spoiled(draw: st.DrawFn, text: str) -> dict[str, Any]:
    """Return the data of a scene file with one to three entries changed or added."""
    data = tomllib.loads(text)
    for _ in range(draw(st.integers(1, 3))):
        *way, last = draw(st.sampled_from(list(_places(data))))
        table = functools.reduce(operator.getitem, way, data)
        added = isinstance(table, dict) and draw(st.booleans())
        table[draw(_NAMES) if added else last] = copy.deepcopy(draw(_ODD))
    return data


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(spoiled(WHEEL), spoiled(CAR + LEFT + RIGHT) | st.builds(lambda: tomllib.loads(CAR + LEFT + RIGHT)))
def test_hostile_parts_are_scenes_or_problems(part: dict[str, Any], car: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as name, pytest.MonkeyPatch.context() as patch:
        (Path(name) / "wheel.toml").touch()
        patch.setattr("eomgen.scene.sources.toml.toml_data", lambda text, file: (copy.deepcopy(part), {}))
        try:
            scene = from_data(car, folder=Path(name))
        except eomgen.EomgenError as error:
            assert error.exit_code == 3
            assert str(error).isascii() and all(len(line) < 500 for line in str(error).splitlines())
        else:
            assert scene.digest and "nan" not in repr(scene.springs)


def test_starts_of_an_include_have_units_and_their_own_place(tmp_path: Path) -> None:
    (tmp_path / "wheel.toml").write_text(WHEEL, encoding="utf-8")
    text = '[include.front]\nfile = "wheel.toml"\ninitial = { travel = { position = "5 cm" } }\n'
    scene = made(tmp_path, CAR + text)
    (joint,) = [joint for joint in scene.joints if joint.name == "front_travel"]
    assert joint.initial_position == pytest.approx([0.05])
    for wrong, fault in (("5 kg", "is a mass, a length in m is expected"), ("five", "unknown name 'five'")):
        with pytest.raises(DescriptionError, match=fault) as caught:
            made(tmp_path, CAR + text.replace("5 cm", wrong))
        assert "wheel.toml" not in str(caught.value)


# -- nothing is forgotten ----------------------------------------------------------------------------------------------

#: Keys whose texts are no names of entries.
_PLAIN = """
    name distribution task_frames description indices where initial keyframe packages weld unit method energy
    quiet file color x y function python partials arguments results scales source prefix parameters lock tunable
    argument value outputs signal_gains signal_weights settings shape
"""


def test_every_key_that_names_an_entry_says_so() -> None:
    """A name that is not renamed would point out of an included file."""
    silent = [
        f"{name}.{key}: key(..., refers=...) of schema_key, or a place in _PLAIN"
        for name, model in tables_of(DOCUMENT).items()
        for key, (meaning, inner) in fields_of(model).items()
        if inner is None
        and not (meaning.refers or meaning.unit or meaning.names or key in _PLAIN.split() or key.endswith("_unit"))
        if str in _types(next(f.annotation for n, f in model.model_fields.items() if (f.alias or n) == key))
    ]
    assert silent == []


def _types(annotation: Any) -> set[Any]:
    return {annotation}.union(
        *(_types(part) for part in get_args(annotation) if isinstance(part, type) or get_args(part))
    )


def test_every_kind_of_name_in_formulas_has_its_section() -> None:
    """Motions are inputs, exact beams are beams, and are in their sections."""
    others = ["controllers", "curve_arguments", "entries", "labels", "laws", "exact_beams", "motions", "offered"]
    assert {field.name for field in dataclasses.fields(SceneNames)} - {*others} <= set(SECTIONS)
