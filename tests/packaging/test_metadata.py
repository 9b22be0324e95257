"""What is said of the package in several files is the same in all: version, dependencies, Python, changelog."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from eomgen.base.version import __version__

CHECKOUT = Path(__file__).parents[2]
PROJECT: dict[str, Any] = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
#: Names of packages at conda-forge that differ.
_CONDA = {"matplotlib": "matplotlib-base"}


def text_of(name: str) -> str:
    return (CHECKOUT / name).read_text(encoding="utf-8")


def test_the_version_is_one() -> None:
    assert f"\nversion: {__version__}\n" in text_of("CITATION.cff")
    assert f'\n  version: "{__version__}"\n' in text_of(".github/conda/recipe.yaml")
    assert "version" in PROJECT["project"]["dynamic"]


def test_the_conda_recipe_has_the_dependencies_and_a_compiler() -> None:
    runs = text_of(".github/conda/recipe.yaml").partition("  run:\n")[2].partition("\n\n")[0]
    needed = [re.sub(r">=", " >=", text) for text in PROJECT["project"]["dependencies"]]
    for text in needed:
        name, _, bound = text.partition(" ")
        assert f"    - {_CONDA.get(name, name)} {bound}".rstrip() in runs.splitlines(), text
    assert f"    - python {PROJECT['project']['requires-python']}" in runs.splitlines()
    assert "    - c-compiler" in runs.splitlines()
    assert len(runs.splitlines()) == len(needed) + 2


def test_supported_versions_of_python_are_said_alike() -> None:
    minors = re.findall(r"Python :: 3\.(\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    assert [int(minor) for minor in minors] == list(range(int(minors[0]), int(minors[-1]) + 1))
    assert PROJECT["project"]["requires-python"] == f">=3.{minors[0]}"
    assert f"| Python | 3.{minors[0]} to 3.{minors[-1]} |" in text_of("docs/support.md")
    assert all(f'"3.{minor}"' in text_of(".github/workflows/tests.yml") for minor in minors)


def test_lines_of_the_next_version_are_of_known_kinds() -> None:
    kinds = {item["directory"] for item in PROJECT["tool"]["towncrier"]["type"]}
    files = [file for file in (CHECKOUT / "docs" / "changes").iterdir() if file.name != "README.md"]
    for file in files:
        parts = file.name.split(".")
        assert len(parts) == 3 and parts[1] in kinds and parts[2] == "md", file
        assert file.read_text(encoding="utf-8").strip(), file
    assert all(f"`{kind}`" in text_of("docs/changes/README.md") for kind in kinds)
    assert PROJECT["tool"]["towncrier"]["start_string"] in text_of("CHANGELOG.md")


@pytest.mark.parametrize("name", ["fault", "wish"])
def test_forms_of_issues_ask_for_the_doctor(name: str) -> None:
    text = text_of(f".github/ISSUE_TEMPLATE/{name}.yml")
    assert "eomgen doctor --json" in text and "render: json" in text


def test_links_of_the_pages_in_github_lead_somewhere() -> None:
    pages = [*(CHECKOUT / ".github").glob("*.md"), CHECKOUT / "docs" / "changes" / "README.md"]
    links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text("utf-8"))]
    assert len(links) >= 8
    assert [(page, link) for page, link in links if not (page.parent / link).exists()] == []
