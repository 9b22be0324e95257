"""Every example has a page whose commands are commands, whose files are there, and whose measured part is that of its
study."""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path

import pytest

from benchmarks.example_pages import BEGIN, DEMANDS, END, PAGES, STUDIES, command, power
from docs.site.gallery import built_pictures
from docs.site.pictures import rows_of
from tests.docs.test_docs import command as verb_named

ROOT = Path(__file__).parents[2]
#: Folders of scenes; the others, whose models are documents of front ends of their own, stand below the table.
FOLDERS = sorted({path.parent.name for path in (ROOT / "examples").glob("*/*.toml")})
OTHERS = sorted({path.parent.name for path in (ROOT / "examples").glob("*/README.md")} - set(FOLDERS))
NAMES = [*FOLDERS, "README"]


def text_of(name: str) -> str:
    return (PAGES / f"{name}.md").read_text(encoding="utf-8")


def commands(text: str) -> list[list[str]]:
    """Return the words of every indented line that starts with eomgen or python."""
    return [
        shlex.split(line, comments=True) for line in re.findall(r"^ {4}((?:eomgen|python) .+)$", text, re.MULTILINE)
    ]


def test_every_example_has_a_page_a_study_and_a_row() -> None:
    assert sorted(STUDIES) == FOLDERS
    assert sorted(path.stem for path in PAGES.glob("*.md")) == sorted(NAMES)
    assert re.findall(r"^\| \[(\w+)\]\(\1\.md\) \|", text_of("README"), re.MULTILINE) == FOLDERS
    assert re.findall(r"^- \[(\w+)\]\(\.\./\.\./examples/\1/README\.md\)", text_of("README"), re.MULTILINE) == OTHERS


@pytest.mark.parametrize("name", NAMES)
def test_commands_parse_and_their_files_are_there(name: str) -> None:
    found = commands(text_of(name))
    assert found
    for program, verb, *words in found:
        if program == "python":
            script = ROOT / (words[0].replace(".", "/") + ".py" if verb == "-m" else verb)
            assert script.is_file(), script
            continue
        context = verb_named(verb).make_context(verb, list(words))
        assert (ROOT / context.params["scene"]).is_file(), context.params["scene"]
        assert context.params["folder"].startswith("out/")


def test_commands_of_the_examples_themselves_parse() -> None:
    """Options that a command needs are there: ``--out``, for one."""
    seen = 0
    for path in sorted((ROOT / "examples").glob("*/README.md")):
        for program, verb, *words in commands(path.read_text(encoding="utf-8")):
            if program == "python":
                continue
            context = verb_named(verb).make_context(verb, list(words))
            files = [value for key, value in context.params.items() if key in ("scene", "file", "document")]
            assert files and all((ROOT / file).is_file() for file in files), (path, verb, words)
            seen += 1
    assert seen > 10


@pytest.mark.parametrize("name", FOLDERS)
def test_the_measured_part_is_that_of_the_study(name: str) -> None:
    text = text_of(name)
    before, begin, rest = text.partition(BEGIN)
    measured, end, _ = rest.partition(END)
    assert begin and end and before.startswith("# ")
    assert commands(measured) == [shlex.split(command(name))]
    assert re.findall(r"^\| (\S+) \| (?!cheapest|--)", measured, re.MULTILINE)[-len(DEMANDS) :] == [
        power(demand) for demand in DEMANDS
    ]
    assert len(rows_of(measured)) == len(set(re.findall(r"\| \d\S*e-\d\d \| .*", measured)))


@pytest.mark.parametrize("name", NAMES)
def test_links_lead_somewhere(name: str) -> None:
    links = re.findall(r"\]\((?!https?:)([^)\s#]+)", text_of(name))
    assert links
    for target in links:
        assert (PAGES / target).exists() or os.path.relpath(PAGES / target, ROOT) in built_pictures(), target
