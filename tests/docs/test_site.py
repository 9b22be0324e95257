"""The documentation site: every public name, verb, method and section has one page, and links lead to pages."""

from __future__ import annotations

import inspect
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

import eomgen
from docs.site.pages import HOW_TO, Page, Site, anchor, relinked, site_pages, split, write
from docs.site.reference import INTERNAL, MODULES, RESULTS, members, public_objects, reference_pages
from eomgen.cli import VERBS
from eomgen.integrators.families.register import method_names
from eomgen.scene.document.schema import Document


@cache
def site() -> Site:
    """Return all pages."""
    return site_pages(reference_pages())


def test_every_public_name_is_on_one_page_of_the_reference() -> None:
    places = [place.lower() for place, _ in public_objects().values()]  # folders of some systems ignore case
    assert len(set(places)) == len(places)
    pages = {place: page.text for place, page in site().pages.items() if place.startswith("reference/python/")}
    objects = [value for _, value in public_objects().values()]
    for module in ("eomgen", *MODULES.values()):
        owner = import_module(module)
        for name in getattr(owner, "__all__", ()):
            value = getattr(owner, name, None)
            if value is None or inspect.ismodule(value) or name.startswith("_"):
                continue
            assert sum(value is other for other in objects) == 1, f"{module}.{name}"
    for name, (place, _) in public_objects().items():
        described = [where for where, text in pages.items() if f":: {name}\n" in text]
        assert described == [place]


def test_internal_methods_and_classes_of_results_are_there() -> None:
    kinds = {value.__name__: value for _, value in public_objects().values() if inspect.isclass(value)}
    assert RESULTS.keys() <= kinds.keys()
    for name in INTERNAL:
        kind, _, member = name.partition(".")
        assert hasattr(kinds[kind], member), name


def test_every_method_of_the_model_is_on_its_page() -> None:
    listed = {name for name, _, _ in members(eomgen.Model)}
    assert {"simulate", "mass", "linearize", "nq", "parameters"} <= listed and "stepper" not in listed
    text = site().pages["reference/python/Model"].text
    assert all(text.count(f":: eomgen.Model.{name}\n") == 1 for name in listed)


def test_every_verb_method_and_section_has_its_page() -> None:
    pages = site().pages
    for verb in VERBS:
        assert f"$ eomgen {verb} --help\nUsage: eomgen {verb}" in pages[f"reference/command_line/{verb}"].text
    table = pages["reference/methods/index"].text
    assert all(f"`{name}`" in table for name in method_names())
    assert {f"reference/scene/{row.key}" for row in Document.rows} - pages.keys() == set()


def test_every_how_to_page_has_a_subject() -> None:
    pages = {place.rpartition("/")[2] for place in site().pages if place.startswith("how_to/")} - {"index"}
    assert sorted(pages) == sorted(name for names in HOW_TO.values() for name in names)
    assert "## Vibration\n\n```{toctree}\n:maxdepth: 1\n\nnatural_" in site().pages["how_to/index"].text


def test_all_links_lead_to_pages_and_files(tmp_path: Path) -> None:
    write(site(), tmp_path)
    assert (tmp_path / "reference" / "scene" / "springs.md").read_text(encoding="utf-8").startswith("# springs\n")
    assert "](../../theory/" not in (tmp_path / "index.md").read_text(encoding="utf-8")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.md")}
    (tmp_path / "left_over.md").write_text("", encoding="utf-8")
    write(site(), tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.md")} == before


def test_links_follow_headings_to_their_new_pages() -> None:
    small = Site()
    for page in split("docs/scene.md", "scene"):
        small.add(page)
    text = "[one](docs/scene.md#springs), `[no](link)`, [`file.c`](file.c), [it](file.c)"
    made = relinked(Page("a/b", text, "page.md"), small, str)
    assert made == "[one](../scene/springs.md), `[no](link)`, `file.c`, it (`file.c`)"
    with pytest.raises(ValueError, match=r"page\.md: docs/scene\.md has no heading time-laws"):
        relinked(Page("a/b", "[two](docs/scene.md#time-laws)", "page.md"), small, str)
    assert anchor("Steps by a tolerance: `rk45`") == "steps-by-a-tolerance-rk45"


@pytest.mark.slow
def test_sphinx_builds_pages_of_each_kind_without_a_warning(tmp_path: Path) -> None:
    from sphinx.cmd.build import build_main  # the second tier alone installs Sphinx's themes

    some = (
        "reference/python/Problem",
        "reference/python/results/Modes",
        "reference/scene/springs",
        "theory/equilibria",
    )
    sources, pages = tmp_path / "sources", site()
    write(pages, sources)
    kept = {sources / f"{place}{pages.pages[place].ending}" for place in some}
    for path in [*sources.rglob("*.md"), *sources.rglob("*.rst")]:
        if path not in kept:
            path.unlink()
    lines = "\n".join(some)
    (sources / "index.md").write_text(f"# Site\n\n```{{toctree}}\n{lines}\n```\n", encoding="utf-8")
    settings = Path(__file__).parents[2] / "docs" / "site"
    suppressed = "suppress_warnings=myst.xref_missing,ref.doc"
    words = ["-b", "dirhtml", "-W", "-q", "-D", suppressed, "-c", str(settings)]
    assert build_main([*words, str(sources), str(tmp_path / "html")]) == 0
    modes = (tmp_path / "html" / "reference" / "python" / "results" / "Modes" / "index.html").read_text(
        encoding="utf-8"
    )
    assert 'id="eomgen.linear.modes.Modes"' in modes and "Participation" not in modes.partition("<body")[0]
