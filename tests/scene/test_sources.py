"""The register of sources: kinds of files, their options, and those that other distributions add."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from eomgen.formula.nodes import Number
from eomgen.scene.sources.register import all_options, own_sources, source_of, sources
from eomgen.scene.sources.source import Source
from tests.scene.distributions import install

#: A format of somebody else: as many equal links, one below the other, as the file says.
CHAINS = """
from eomgen import DescriptionError, Problem
from eomgen.scene.sources.source import ConvertedScene, Option, Source


def read(text, *, file, strict=False, included=False, mass=1.0, long=False):
    if not text.strip().isdigit():
        raise DescriptionError(Problem(f"{file}:1", "a number of links is needed", "3"))
    names = [f"link{k}" for k in range(int(text))]
    length = 2.0 if long else 1.0
    body = {"mass": 1.0, "center_of_mass": [0, 0, -length / 2], "inertia": [0.1, 0.1, 0.01]}
    joints = {
        f"hinge_{name}": {"type": "revolute", "parent": parent, "child": name, "axis": [0, 1, 0],
                          "position": [0, 0, 0 if parent == "base" else -length]}
        for parent, name in zip(["base", *names], names)
    }
    data = {"format": 1, "name": "chain", "bodies": {name: dict(body) for name in names}, "joints": joints}
    return ConvertedScene(data, {"bodies": 1}, [f"{len(names)} links"])


CHAINS = Source("chains", (".chain",), "a .chain file", read, (Option("long", False, "links of two metres"),))
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install a distribution that gives a source, and return a folder for files."""
    (tmp_path / "chainfiles.py").write_text(CHAINS, encoding="utf-8")
    install(tmp_path, monkeypatch, "chainfiles", "[eomgen.sources]\nchains = chainfiles:CHAINS\n")
    sources.cache_clear()
    yield tmp_path
    sources.cache_clear()
    sys.modules.pop("chainfiles", None)


@pytest.mark.parametrize("source", own_sources(), ids=lambda source: source.name)
def test_every_row_reads_by_its_endings_and_its_options_are_on_the_command_line(
    source: Source, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for ending in source.endings:
        file = tmp_path / f"robot{ending.upper()}"
        file.write_text(f"<!-- <robot> -->\n<{source.root}/>", encoding="utf-8")
        assert source_of(file) is source
    assert main(["simulate", "--help-files"]) == 0
    help_text = capsys.readouterr().out
    for option in source.options:
        assert f"--{option.name}" in help_text
        assert all(choice in help_text for choice in option.choices)


def test_options_of_one_name_mean_the_same_in_all_sources() -> None:
    options = [option for source in own_sources() for option in source.options]
    assert {option.name for option in options} == all_options().keys()
    assert all(option == all_options()[option.name][1] for option in options)


def test_a_distribution_brings_a_source(installed: Path) -> None:
    file = installed / "rope.chain"
    file.write_text("3\n", encoding="utf-8")
    scene = eomgen.load(file)
    assert [body.name for body in scene.bodies] == ["link0", "link1", "link2"]
    assert scene.notes == ("3 links",)
    assert eomgen.load(file, long=True).bodies[0].center_of_mass != scene.bodies[0].center_of_mass
    model = eomgen.build(file, terms=["mass"], profile="quick")
    assert model.nv == 3


def test_a_distribution_s_source_may_be_included(installed: Path) -> None:
    (installed / "rope.chain").write_text("2\n", encoding="utf-8")
    scene = installed / "scene.toml"
    scene.write_text('format = 1\nname = "two"\n[include.left]\nfile = "rope.chain"\n', encoding="utf-8")
    assert [body.name for body in eomgen.load(scene).bodies] == ["left_link0", "left_link1"]


def test_options_of_a_distribution_s_source_are_keys_of_an_include(installed: Path) -> None:
    (installed / "rope.chain").write_text("2\n", encoding="utf-8")
    scene = installed / "scene.toml"
    text = 'format = 1\nname = "two"\n[include.left]\nfile = "rope.chain"\n{}\n'
    scene.write_text(text.format("long = true"), encoding="utf-8")
    assert eomgen.load(scene).bodies[0].center_of_mass[2] == Number(-1.0)
    for line, problem in {
        'long = "very"': r"scene\.toml:5 \(include\.left\.long\): true or false is needed here, not 'very'",
        'root = "free"': r"scene\.toml:5 \(include\.left\.root\): root is for URDF only",
        "lng = true": r"scene\.toml:5 \(include\.left\.lng\): the key 'lng' is unknown here; try: long",
    }.items():
        scene.write_text(text.format(line), encoding="utf-8")
        with pytest.raises(eomgen.DescriptionError, match=problem):
            eomgen.load(scene)


def test_what_a_source_of_others_refuses_is_said_like_everything_else(installed: Path) -> None:
    file = installed / "rope.chain"
    file.write_text("three\n", encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match=r"rope\.chain:1: a number of links is needed; try: 3"):
        eomgen.load(file)
    with pytest.raises(
        eomgen.UsageError, match="root, lock, limits, friction, actuated, transmissions and tunable are for URDF only"
    ):
        eomgen.load(file, root="free")
    with pytest.raises(eomgen.UsageError, match="load: there is no argument 'lng'; try: long"):
        eomgen.load(file, lng=True)
    hint = "is not a kind of file that can be read; try: a .toml scene, a .urdf file, an .xml file of"
    hint += " MuJoCo, an .sdf file or a .chain file"
    with pytest.raises(eomgen.UsageError, match=hint):
        eomgen.load("rope.chains")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("raise RuntimeError('no licence')", "does not load: RuntimeError: no licence"),
        ("CHAINS = 3", r"is not an eomgen\.scene\.sources\.source\.Source"),
        (CHAINS.replace('".chain"', '".urdf"'), r"reads \.urdf files, which another source does"),
    ],
)
def test_a_distribution_that_is_broken_is_named(installed: Path, text: str, what: str) -> None:
    (installed / "chainfiles.py").write_text(text, encoding="utf-8")
    name = r"the entry point 'chains' \(chainfiles:CHAINS\) in eomgen\.sources of the distribution chainfiles"
    with pytest.raises(eomgen.UsageError, match=f"{name} {what}; try: another version of chainfiles, or uninstall it"):
        eomgen.load("rope.chain")
    # needs no other source
    assert eomgen.load(Path(__file__).parents[2] / "examples/four_bar/scene.toml").name == "four_bar"


def test_model_directives_are_refused_with_their_replacement(tmp_path: Path) -> None:
    file = tmp_path / "cell.dmd.yaml"
    file.write_text("directives: []\n", encoding="utf-8")
    remedy = r"try: \[include\.NAME\] of each model that Drake adds, in a scene file"
    with pytest.raises(eomgen.UsageError, match=remedy):
        eomgen.load(file)
