"""The documentation site: every public name, verb, method and section has one page, and links lead to pages."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import eomgen
from benchmarks.example_pages import STUDIES
from docs.site.__main__ import built_pages
from docs.site.gallery import MOTIONS, built_pictures, copied, examples, files_of, gallery_pages, picture_of
from docs.site.pages import (
    IN_PARTS,
    ROOT,
    Page,
    Site,
    anchor,
    external_links,
    headings,
    moved_anchors,
    parts_of,
    read,
    relinked,
    site_pages,
    write,
)
from docs.site.plain_text import write_plain_text
from docs.site.reference import (
    GROUPS,
    INTERNAL,
    MODULES,
    SESSIONS,
    command_pages,
    members,
    public_objects,
    reference_pages,
    sessions,
)
from eomgen.base.products import products
from eomgen.cli import VERBS
from eomgen.integrators.families.register import method_names
from eomgen.scene.document.schema import every_document
from eomgen.system.system import INPUT_BLOCKS
from tests.browser.widths import WIDTHS, faults
from tests.product_parts import facts_of

DOCUMENT = every_document()
#: Any picture in place of the ones that a build draws.
DRAWN = dict.fromkeys(built_pictures(), ROOT / "docs" / "live.png")


@cache
def site() -> Site:
    """Return all pages."""
    return site_pages((*gallery_pages(), *reference_pages(), *built_pages()))


@pytest.mark.slow
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


@cache
def _names_of(module: str) -> dict[str, object]:
    """Return the names of a module, with imports for type checkers."""
    found = dict(vars(import_module(module)))
    for node in ast.walk(ast.parse(inspect.getsource(import_module(module)))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("eomgen") and find_spec(str(node.module)):
            owner = import_module(str(node.module))
            found |= {item.asname or item.name: getattr(owner, item.name, None) for item in node.names}
    return found


def _reached() -> Iterator[type]:
    """Yield the classes of the package in annotations of public fields and of results of public functions."""
    for _, value in public_objects().values():
        annotations = [(value.__module__, getattr(value, "__annotations__", {}))] if inspect.isclass(value) else []
        functions = (
            [it for _, _, it in members(value)] if inspect.isclass(value) else [value] * inspect.isfunction(value)
        )
        for function in functions:
            plain = inspect.unwrap(getattr(function, "fget", None) or getattr(function, "func", function))
            result = getattr(plain, "__annotations__", {}).get("return")
            annotations.append((getattr(plain, "__module__", ""), {} if result is None else {"return": result}))
        for module, texts in filter(lambda item: item[1], annotations):
            words = {word for name, text in texts.items() if name[0] != "_" for word in re.findall(r"\w+", str(text))}
            named = [_names_of(module).get(word) for word in words]
            yield from (one for one in named if inspect.isclass(one) and one.__module__.startswith("eomgen."))


@pytest.mark.slow
def test_every_class_that_public_names_lead_to_has_a_page() -> None:
    pages = [value for _, value in public_objects().values()]
    lacking = {f"{one.__module__}.{one.__name__}" for one in _reached() if not any(one is page for page in pages)}
    known = re.findall(
        r"^eomgen.+", Path(__file__).with_name("classes_without_page.txt").read_text("utf-8"), re.MULTILINE
    )
    assert lacking == {*known, *(name for product in products() for name in facts_of(product).get("without_page", ()))}


def test_internal_methods_and_classes_of_results_are_there() -> None:
    kinds = {value.__name__: value for _, value in public_objects().values() if inspect.isclass(value)}
    assert {name for _, _, classes in GROUPS.values() for name in classes} <= kinds.keys()
    for name in INTERNAL:
        kind, _, member = name.partition(".")
        assert hasattr(kinds[kind], member), name


@pytest.mark.slow
def test_every_method_of_the_model_is_on_its_page() -> None:
    listed = {name for name, _, _ in members(eomgen.Model)}
    assert {"simulate", "mass", "linearize", "nq", "parameters"} <= listed and "stepper" not in listed
    text = site().pages["reference/python/Model"].text
    assert all(text.count(f":: eomgen.Model.{name}\n") == 1 for name in listed)


@pytest.mark.slow
def test_every_verb_method_and_section_has_its_page() -> None:
    pages = site().pages
    for verb in VERBS:
        assert f"$ eomgen {verb} --help\nUsage: eomgen {verb}" in pages[f"reference/command_line/{verb}"].text
    table = pages["reference/methods/index"].text
    assert all(f"`{name}`" in table for name in method_names())
    interface = pages["reference/c_interface"].text
    assert all(f"| `{block}` |" in interface for block in INPUT_BLOCKS) and "#endif" not in interface
    assert "## Time integration" in interface and "arm_status arm_simulator_step(" in interface
    assert {f"reference/scene/{row.key}" for row in DOCUMENT.rows} - pages.keys() == set()


def test_pages_of_verbs_show_output_of_commands() -> None:
    assert {line.split()[0] for line in SESSIONS} < set(VERBS)
    shown = sessions({"new", "migrate", "cite"})
    assert shown["new"].startswith("$ eomgen new arm\nnext: eomgen simulate arm/scene.toml") and "cite" in shown
    pages = {page.place: page.text for page in command_pages(shown)}
    assert f"## Example\n\n```text\n{shown['new']}\n```" in pages["reference/command_line/new"]
    assert "## Example" not in pages["reference/command_line/info"]


@pytest.mark.slow
def test_all_links_lead_to_pages_and_files(tmp_path: Path) -> None:
    write(site(), tmp_path, DRAWN)
    assert (tmp_path / "reference" / "scene" / "springs.md").read_text(encoding="utf-8").startswith("# springs\n")
    assert "](../../theory/" not in (tmp_path / "index.md").read_text(encoding="utf-8")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.md")}
    (tmp_path / "left_over.md").write_text("", encoding="utf-8")
    write(site(), tmp_path, DRAWN)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.md")} == before


def test_links_to_other_sites_are_listed_with_their_pages() -> None:
    links = external_links(site())
    assert "tutorials/pendulum" in site().pages and len(links) > 5
    assert all(address.startswith("https://") for address in links)
    small = Site()
    small.add(Page("a", "[one](https://one.example), `[no](https://no.example)`, [two](b.md)", "a.md"))
    assert external_links(small) == {"https://one.example": ["a"]}


def test_links_to_anchors_of_pages_in_parts_lead_to_the_parts() -> None:
    small = Site(moved=moved_anchors("docs/scene.md"))
    for page in (
        Page("scene/index", read("docs/scene.md"), "docs/scene.md"),
        *(Page(f"scene/{Path(part).stem}", read(part), part) for part in parts_of("docs/scene.md")),
    ):
        small.add(page)
    text = "[one](docs/scene.md#springs), `[no](link)`, [`file.c`](file.c), [it](file.c), [two](docs/scene.md#jumps)"
    made = relinked(Page("a/b", text, "page.md"), small, str)
    expected = "[one](../scene/springs.md), `[no](link)`, `file.c`, it (`file.c`), [two](../scene/inputs.md#jumps)"
    assert made == expected
    with pytest.raises(ValueError, match=r"page\.md: docs/scene\.md has no heading time-laws"):
        relinked(Page("a/b", "[two](docs/scene.md#time-laws)", "page.md"), small, str)
    assert anchor("Steps by a tolerance: `rk45`") == "steps-by-a-tolerance-rk45"


def test_pages_in_parts_keep_an_anchor_for_each_heading_and_list_each_part() -> None:
    for page in IN_PARTS:
        folder = ROOT / page.removesuffix(".md")
        assert {f"{page.removesuffix('.md')}/{file.name}" for file in folder.glob("*.md")} == set(parts_of(page))
        for part in parts_of(page):
            first, *others = headings(read(part))
            assert read(page).count(f'<a id="{anchor(first)}"></a>[{first}]') == 1
            targets = {place for place in moved_anchors(page).values() if place[0] == part}
            assert targets == {(part, ""), *((part, anchor(heading)) for heading in others)}


def test_every_example_is_in_the_gallery_with_picture_animation_files_and_cost() -> None:
    pages, cards = site().pages, site().pages["gallery/contents"].text
    assert len(examples()) >= 54
    for name in examples():
        text = pages[f"gallery/{name}"].text
        assert cards.count(f'<a class="card" href="../{name}/"><img src="../../{copied(name)}"') == 1
        assert (ROOT / picture_of(name)).is_file() != (picture_of(name) in built_pictures())
        assert files_of(name) and all(
            f"`{file.relative_to(ROOT / 'examples' / name)}`" in text for file in files_of(name)
        )
        assert (f'src="../../animations/{name}.html"' in text) == (name in MOTIONS)
        assert ("\n| demand | cheapest that meets it |" in text) == (name in STUDIES)
        assert site().anchors.get((f"docs/examples/{name}.md", "")) == (f"gallery/{name}" if name in STUDIES else None)


def test_the_first_page_is_short() -> None:
    """One and a half screens: 1400 px of text 830 px wide in Chromium, with 394 words and 33 lines of code."""
    text = re.sub(r"<details>.*?</details>", "", read("README.md"), flags=re.DOTALL)
    code = [line for line in re.findall(r"^(?: {4}.+|[\w\[].* = .*|\[.*\])$", text, re.MULTILINE) if line]
    assert len(re.sub(r"\]\([^)]*\)|<[^>]*>", "]", text).split()) <= 400 and len(code) <= 40


#: Words that a page may have without blocks of code and generated tables.
MOST_WORDS = 3000


def words(text: str) -> int:
    """Return the number of words of a page without its blocks of code and the tables made from the schema."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"<!-- (?:keys of \w+|units|runs) -->.*?<!-- end -->", "", text, flags=re.DOTALL)
    return len(re.findall(r"[A-Za-z']+", text))


def test_no_page_is_too_long() -> None:
    files = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").glob("*/README.md")]
    pages = [file for file in files if "_build" not in file.parts]
    counted = {str(page.relative_to(ROOT)): words(page.read_text(encoding="utf-8")) for page in pages}
    assert {page: count for page, count in counted.items() if count > MOST_WORDS} == {}
    assert words("one two\n```toml\nthree\n```\n<!-- keys of Joint -->\n| four |\n<!-- end -->\nfive's") == 3


def test_plain_text_has_all_pages_and_all_sections(tmp_path: Path) -> None:
    write_plain_text(site(), tmp_path)
    text = (tmp_path / "llms.txt").read_text(encoding="utf-8")
    assert text.startswith("# eomgen\n\n> eomgen derives the equations of motion")
    assert all(f"({place}/)" in text for place in site().pages if place.startswith(("tutorials/", "how_to/", "guide/")))
    reference = (tmp_path / "scene_reference.txt").read_text(encoding="utf-8")
    assert not re.search(r"(?<![!`])\[[\w ]+\]\([\w/#.-]+\)", reference.replace("![", "!"))
    assert all(f"`{row.key}" in reference or f"[{row.key}" in reference for row in DOCUMENT.rows)


@pytest.mark.long
def test_sphinx_builds_pages_of_each_kind_without_a_warning(tmp_path: Path) -> None:
    from sphinx.cmd.build import build_main  # the second tier alone installs Sphinx's themes

    some = (
        "reference/python/Problem",
        "reference/python/results/Modes",
        "reference/scene/springs",
        "theory/equilibria",
    )
    sources, pages = tmp_path / "sources", site()
    write(pages, sources, DRAWN)
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
    springs = (tmp_path / "html" / "reference" / "scene" / "springs" / "index.html").read_text(encoding="utf-8")
    assert "stacked docutils" in springs and '<span class="cell-head">meaning: </span>' in springs
    places = [f"/{place}/" for place in some]
    assert [fault for width in WIDTHS for fault in faults(tmp_path / "html", places, width)] == []
    wide = '<article><p style="width: 900px">wide</p><img src="none.png"></article>'
    (tmp_path / "html" / "wide.html").write_text(wide, encoding="utf-8")
    assert len(faults(tmp_path / "html", ["/wide.html"], 400)) == 3
    assert 'id="eomgen.linear.modes.Modes"' in modes and "Participation" not in modes.partition("<body")[0]
