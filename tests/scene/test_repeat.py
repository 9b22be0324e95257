"""Tables whose entries are made once for each number of their indices."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from eomgen.scene.load import load, load_toml

HEAD = 'format = 1\nname = "chain"\n'
CHAIN = """
bodies.link_0 = { mass = 1.0, center_of_mass = [0.1, 0, 0], inertia = [0.1, 0.1, 0.1] }
joints.hinge_0 = { type = "revolute", parent = "base", child = "link_0", axis = [0, 1, 0] }
[parameters]
pitch = { value = "250 mm", tunable = true }
[repeat.links]
indices = { i = [1, 4] }
[repeat.links.bodies."link_{i}"]
mass = "{1 + 0.5 * i}"
center_of_mass = ["{i} * pitch", 0, "{0 if i < 3 else -0.5}"]
inertia = [0.1, 0.1, 0.1]
[repeat.links.joints."hinge_{i}"]
type = "revolute"
parent = "link_{i - 1}"
child = "link_{i}"
axis = [0, 1, 0]
position = ["pitch", 0, 0]
initial = { position = "{0.1 * i}" }
"""


def test_copies_are_the_entries_that_would_be_written() -> None:
    scene = load_toml(HEAD + CHAIN)
    builder = eomgen.SceneBuilder("chain").parameter("pitch", "250 mm", tunable=True)
    for i in range(5):
        place = [f"{i} * pitch", 0, 0 if i < 3 else -0.5] if i else [0.1, 0, 0]
        builder.body(f"link_{i}", 1.0 + 0.5 * i, center_of_mass=place, inertia=[0.1, 0.1, 0.1])
        keys = {"position": ["pitch", 0, 0], "initial": {"position": 0.1 * i}} if i else {}
        builder.joint(f"hinge_{i}", "revolute", f"link_{i - 1}" if i else "base", f"link_{i}", axis=[0, 1, 0], **keys)
    written = builder.build()
    assert (scene.bodies, scene.joints) == (written.bodies, written.joints)


def test_a_condition_takes_some_of_all_combinations() -> None:
    springs = """
[repeat.between]
indices = { i = 5, j = 5 }
where = "i < j and j < i + 3"
[repeat.between.points]
"end_{i}_{j}" = { body = "link_{i}", position = [0, 0, "{0.01*j}"] }
"""
    scene = load_toml(HEAD + CHAIN + springs)
    pairs = [(i, j) for i in range(5) for j in range(5) if i < j < i + 3]
    assert [point.name for point in scene.points] == [f"end_{i}_{j}" for i, j in pairs]
    assert scene.metadata["repeat"] == {"links": 4, "between": len(pairs)}
    with pytest.raises(
        eomgen.DescriptionError, match=r"scene.toml:\d+ \(repeat.between.where\): a formula is needed here"
    ):
        load_toml(HEAD + CHAIN + springs.replace('"i < j and j < i + 3"', "3"))
    with pytest.raises(eomgen.DescriptionError, match=r"\(repeat.between.where\): .*'k'"):
        load_toml(HEAD + CHAIN + springs.replace("i < j and", "i < k and"))


@pytest.mark.slow
def test_what_repeats_is_said_by_info(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Names that count over whole ranges are shown by the first and the last; few are listed."""
    text = """
[repeat.knots]
indices = { i = 3, j = [1, 4] }
bodies."knot_{i}_{j}" = { mass = 0.1, inertia = [1e-5, 1e-5, 1e-5], group = "R3xSO3" }
joints."free_{i}_{j}" = { type = "free", parent = "base", child = "knot_{i}_{j}" }

[repeat.ends]
indices = { i = 2 }
bodies."end_{i}" = { mass = 0.1, inertia = [1e-5, 1e-5, 1e-5], group = "R3xSO3" }
joints."at_{i}" = { type = "free", parent = "base", child = "end_{i}" }
"""
    scene, expected = tmp_path / "net.toml", "knot_0_1.position to knot_2_4.position, end_0.position, end_1.position"
    scene.write_text(HEAD + 'coordinates = "absolute"\n' + text, encoding="utf-8")
    assert main(["info", str(scene), "--terms", "energy"]) == 0
    out = capsys.readouterr().out
    assert "Repeated: knots 12 times, ends 2 times\n" in out and expected in " ".join(out.split())
    assert load(scene).metadata["repeat"] == {"knots": 12, "ends": 2}


def told(change: tuple[str, str]) -> str:
    with pytest.raises(eomgen.DescriptionError) as caught:
        load_toml(HEAD + CHAIN.replace(*change))
    return str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("indices = { i = [1, 4] }", ""), "scene.toml:8 (repeat.links.indices): the key indices is missing"),
        (("i = [1, 4]", "i = [4, 1]"), "scene.toml:9 (repeat.links.indices.i): the index i takes no number from 4"),
        (("i = [1, 4]", "i = 1.5"), "scene.toml:9 (repeat.links.indices.i): an index counts by whole numbers,"),
        (("i = [1, 4]", "i = 4, j = 100001"), "scene.toml:9 (repeat.links.indices): more than 200000 copies are made"),
        (("i = [1, 4]", "i = 2, j = 2"), "the name link_0 in bodies is given twice"),
        (('"link_{i - 1}"', '"link_{i - 1"'), "has a brace without its other; try: {i}"),
        (('"{1 + 0.5 * i}"', '"{1 / (i - 2)}"'), "{1 / (i - 2)} at i = 2: div(1, 0) has no finite value"),
        (("repeat.links.bodies", "repeat.links.bodys"), "there is no section 'bodys' whose entries could repeat"),
        (('joints."hinge_{i}"', 'joints."hinge {i}"'), "the name 'hinge 1' is not legal"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(change: tuple[str, str], message: str) -> None:
    found = told(change)
    assert message in found
    assert "repeat" in found or "scene.toml:" in found


def test_repeat_is_a_table_of_tables() -> None:
    for text, message in (
        ("repeat = 3", "repeat): a table is needed here, not 3"),
        ("[repeat]\nlinks = 3", "repeat.links): a table is needed here, not 3"),
    ):
        with pytest.raises(eomgen.DescriptionError, match=re.escape(message)):
            load_toml(HEAD + text)
