"""``eomgen cite``: every method's papers are in the register, and the printed entries are BibTeX."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from eomgen.integrators.compositions import composition_named
from eomgen.integrators.families.literature import PAPERS, papers_of
from eomgen.integrators.families.register import method_compiled, method_names

ROOT = Path(__file__).parents[2]
#: All methods that can be made: index 3 refuses the trapezoidal rule with any parameter.
METHODS = [name for name in method_names() if name != "trapezoidal_index3"]


def _field(paper: str, name: str) -> str:
    """Return a field of a BibTeX entry."""
    return re.findall(rf"(?m)^  {name} += {{(.*)}},$", paper)[0]


@pytest.mark.parametrize("method", METHODS)
def test_all_papers_of_a_method_are_in_the_register(method: str) -> None:
    source = method_compiled(method).source
    papers = list(papers_of(source))
    years = re.findall(r"\b(?:19|20)\d\d\b", source)
    assert papers and [_field(paper, "year") for paper in papers] == years


def test_every_paper_is_used() -> None:
    sources = [method_compiled(name).source for name in METHODS]
    assert [name for name in PAPERS if not any(name in source for source in sources)] == []
    assert PAPERS["Yoshida 1990"] in list(papers_of(composition_named("yoshida12").source))


def test_names_and_fields_agree() -> None:
    keys = [re.findall(r"@(?:article|book|inproceedings|misc)\{(\w+),\n", paper) for paper in PAPERS.values()]
    assert [len(found) for found in keys] == [1] * len(PAPERS)
    for (name, paper), (key,) in zip(PAPERS.items(), keys, strict=True):
        assert name.endswith(_field(paper, "year")) and key.endswith(_field(paper, "year"))
        authors = _field(paper, "author").replace('{\\"u}', "u").replace("{\\`A}", "A")
        named = re.findall(r"[A-Z][\w-]+", name)
        assert [word for word in named if word not in authors] == [], name
        assert paper.endswith("\n}") and paper.count("{") == paper.count("}")
    assert len({key for (key,) in keys}) == len(PAPERS)


def test_cite_prints_eomgen_and_the_papers_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cite"]) == 0
    own = capsys.readouterr().out
    assert own.startswith("@software{eomgen,") and f"version   = {{{eomgen.__version__}}}" in own
    assert main(["cite", "rk45", "rk4_partitioned"]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"@\w+\{(\w+),", text) == [
        "eomgen",
        "dormand_prince_1980",
        "munthe_kaas_1999",
        "shampine_1986",
        "wehage_haug_1982",
    ]
    assert main(["cite", "--json", "leapfrog"]) == 0
    assert json.loads(capsys.readouterr().out) == ["eomgen", "verlet_1967"]


def test_a_scene_stands_for_its_method_and_a_wrong_name_has_a_remedy(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cite", "--json", str(ROOT / "examples" / "gear_with_backlash" / "scene.toml")]) == 0
    assert "dormand_prince_1980" in json.loads(capsys.readouterr().out)
    assert main(["cite", "leapfrogg"]) == 2
    assert "leapfrog" in capsys.readouterr().err
