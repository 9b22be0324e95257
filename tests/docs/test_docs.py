"""The pages say what is so: scenes on them derive, Python on them runs, keys and options are described, links lead
somewhere."""

from __future__ import annotations

import os
import re
import runpy
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import click
import pytest

import eomgen
from docs.site.gallery import built_pictures
from docs.site.pages import BUILT
from eomgen.cli import INTERRUPTED, VERBS, commands
from eomgen.formula.words import FUNCTIONS
from eomgen.integrators.families.register import method_named, method_names
from eomgen.mechanics.derive import derive
from eomgen.scene.document.reference import schema
from eomgen.scene.document.schema import section_keys
from eomgen.scene.formula.scope import ENERGIES
from eomgen.scene.load import from_data, load_toml
from eomgen.system.terms import TERMS
from tests.docs.parts import PAGES as IN_PARTS
from tests.docs.parts import parts, sections, whole
from tests.test_doors import DOORS

SECTIONS = section_keys()

ROOT = Path(__file__).parents[2]
PAGES = {
    path.name: path.read_text(encoding="utf-8") for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
} | {
    f"{folder}/{path.name}": path.read_text(encoding="utf-8")
    for folder in ("theory", "contributing", *IN_PARTS)
    for path in sorted((ROOT / "docs" / folder).glob("*.md"))
}
#: Pages for contributors and pages of the theory name files of the package.
INSIDE = "\n".join(
    text for page, text in PAGES.items() if page == "architecture.md" or page.startswith(("theory/", "contributing/"))
)
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A fenced block: its page, the page's line on which its text starts, and the text."""

    page: str
    line: int
    text: str


def blocks(language: str, pages: dict[str, str] = PAGES) -> list[Block]:
    return [
        Block(page, text.count("\n", 0, match.start(2)) + 1, match[2])
        for page, text in pages.items()
        for match in _BLOCK.finditer(text)
        if match[1] == language
    ]


def place(block: object) -> str | None:
    return f"{block.page}:{block.line}" if isinstance(block, Block) else None


#: Blocks that pieces need as files: their first line names the file.
FILES = [
    block
    for language in ("csv", "toml", "c", "python")
    for block in blocks(language)
    if re.match(r"(# \w+\.(csv|toml|py)|/\* \w+\.c \*/)\n", block.text)
]
#: Of scenes; what the pages of Hamiltonian systems and of fields hold is run by the tests of these.
SCENES = [block for block in blocks("toml") if block.page not in ("hamiltonian.md", "fields.md")]
WHOLE = [block for block in SCENES if "format" in tomllib.loads(block.text) and block not in FILES]
PIECES = [block for block in SCENES if "format" not in tomllib.loads(block.text)]
EXAMPLE = next(block.text for block in WHOLE if block.page == "scene/an_example.md")


def in_backticks(text: str) -> set[str]:
    return set(re.findall(r"`([^`\n]+)`", text))


@pytest.mark.parametrize("block", WHOLE, ids=place)
def test_whole_scenes_are_derived(block: Block) -> None:
    system = derive(load_toml(block.text, file=block.page))
    # the first scene has no outputs, and whole matrices of large scenes are made on request
    freedoms, terms = {
        "README.md": (1, {"mass", "partials"}),
        "statics.md": (96, {"outputs"}),
    }.get(block.page, (2, {"mass", "partials", "outputs"}))
    assert system.nv == freedoms
    assert {"forward_dynamics", *terms} <= set(system.functions)


@cache
def unchanged() -> object:
    """Return the digest of the example."""
    return load_toml(EXAMPLE).digest


@pytest.mark.slow_cases("scene/random.md:71")
@pytest.mark.parametrize("block", PIECES, ids=place)
def test_pieces_fit_into_the_example(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for file in FILES:
        Path(file.text.split("\n", 1)[0].strip("#/* ")).write_text(file.text, encoding="utf-8")
    first = next(whole.text for whole in WHOLE if whole.page == "README.md")
    data, piece = tomllib.loads(first if block.page == "overview.md" else EXAMPLE), tomllib.loads(block.text)
    for section, entries in piece.items():
        data[section] = {**data.get(section, {}), **entries} if section in (*SECTIONS, "include", "repeat") else entries
    made = from_data(data, file=f"{block.page}:{block.line}")
    assert made.digest != unchanged() or made.shapes  # of pictures alone
    system = derive(made)
    assert system.counts["mass"].statements > 0 or made.coordinates == "absolute" or system.nv == 1  # a number


@pytest.mark.slow
@pytest.mark.long_cases("urdf_robots.md", "python")
@pytest.mark.parametrize("page", ["README.md", "python", "urdf_robots.md"])
def test_python_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(EXAMPLE, encoding="utf-8")
    Path("pendulum.toml").write_text(next(block.text for block in WHOLE if block.page == "README.md"), encoding="utf-8")
    text = {page: whole(page) if page in IN_PARTS else PAGES[page]}  # blocks of all parts are one script
    for block in blocks("xml", text):
        Path("robot.urdf").write_text(block.text, encoding="utf-8")
    lines = [""] * text[page].count("\n")
    for block in blocks("python", text):
        lines[block.line - 1 : block.line - 1 + block.text.count("\n")] = block.text.splitlines()
    script = Path(f"{page}.py")
    script.write_text("\n".join(lines), encoding="utf-8")  # on the page's own lines, so that a traceback points there
    names = runpy.run_path(str(script))
    assert isinstance(names["model"], eomgen.Model) and isinstance(names["solution"], eomgen.Solution)
    assert names["solution"].success
    assert capsys.readouterr().out


# -- nothing is forgotten ----------------------------------------------------------------------------------------------


def referred(node: Any, definitions: dict[str, Any], seen: set[str]) -> Iterator[dict[str, Any]]:
    """Yield a node of the JSON Schema, everything in it, and the definitions it refers to, each once."""
    if isinstance(node, list):
        for item in node:
            yield from referred(item, definitions, seen)
    elif isinstance(node, dict):
        yield node
        name = str(node.get("$ref", "")).rpartition("/")[2]
        if name and name not in seen:
            seen.add(name)
            yield from referred(definitions[name], definitions, seen)
        for item in node.values():
            yield from referred(item, definitions, seen)


def words_of(node: Any, definitions: dict[str, Any]) -> set[str]:
    """Return every key and every word that the schema knows at a node."""
    words: set[str] = set()
    for part in referred(node, definitions, set()):
        if part.get("type") == "object":
            words |= set(part.get("properties", {}))
        words |= {word for word in part.get("enum", []) if isinstance(word, str)}
    return words


def test_every_key_of_the_schema_is_on_the_page() -> None:
    description, texts = schema(), sections("scene")
    by_file = dict(zip((file.stem for file in parts("scene")), texts.values(), strict=True))
    top = in_backticks(texts["Top level"])
    for key, node in description["properties"].items():
        text = texts[key] if key in texts else texts["Top level"]
        linked = set(re.findall(r"\]\(([a-z]+|exact_beams)\.md", text)) - {key}
        text += "".join(by_file.get(link, "") for link in sorted(linked))
        assert key in texts or key in top, f"{key} has no place on the page"
        missing = words_of(node, description["$defs"]) - in_backticks(text) - set("BCDEFG")
        assert not missing, f"docs/scene/{key}.md: {sorted(missing)} not described"


def test_every_term_function_method_and_energy_is_on_the_page() -> None:
    texts = sections("scene")
    formulas = texts["Values and formulas"]
    assert FUNCTIONS.keys() <= {word.partition("(")[0] for word in in_backticks(formulas)}
    assert set(method_names()) <= in_backticks(texts["simulation"])
    assert set(ENERGIES) <= in_backticks(texts["outputs"])


def test_orders_of_methods_are_the_ones_of_the_register() -> None:
    rows = re.findall(r"^\| (`[a-z].*?) \| (\d) \|", sections("scene")["simulation"], re.MULTILINE)
    assert len(rows) > 20
    for names, order in rows:
        assert {method_named(name).order for name in in_backticks(names) if name in method_names()} == {int(order)}


def command(verb: str) -> click.Command:
    found = commands.get_command(click.Context(commands), verb)
    assert found is not None
    return found


def options(verb: str) -> set[str]:
    return {
        name
        for parameter in command(verb).params
        for name in (*parameter.opts, *parameter.secondary_opts)
        if name[0] == "-"
    }


def command_lines() -> list[tuple[str, str]]:
    """Return (page, command) of every line of code that starts with eomgen and a verb in small letters."""
    return [
        (page, match[1])
        for page, text in PAGES.items()
        for match in re.finditer(r"^ {4,}(?:\S*/)?eomgen ([a-z][^#|>\n]*)", text, re.MULTILINE)
    ]


def test_command_lines_on_the_pages_exist() -> None:
    lines = command_lines()
    assert {page for page, _ in lines} >= {"README.md", "command_line/verbs.md"} and len(lines) >= 8
    for page, line in lines:
        verb, *words = line.split()
        assert verb in VERBS, f"{page}: there is no verb {verb}"
        unknown = {word for word in words if word.startswith("-")} - options(verb)
        assert not unknown, f"{page}: eomgen {verb} has no {sorted(unknown)}"


def test_every_verb_and_exit_code_is_on_its_page() -> None:
    words = {word.split()[0] for word in in_backticks(whole("command_line"))}
    assert set(VERBS) <= words
    codes = set(re.findall(r"^\| (\d+) \|", sections("command_line")["Exit codes"], re.MULTILINE))
    assert codes == {str(error.exit_code) for error in errors()} | {"0", "1", str(INTERRUPTED)}


def test_options_of_the_page_are_options_of_their_verbs() -> None:
    rows = re.findall(r"^\| (`-.*?) \| (.*?) \|", sections("command_line")["Options"], re.MULTILINE)
    assert len(rows) > 40
    everywhere, before = {name for verb in VERBS for name in options(verb)}, ""
    for cell, verbs in rows:
        before = before if verbs == "the same" else verbs
        named = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", cell))
        for verb in (word.split()[0] for word in re.sub(r"\(.*?\)", "", before).split(", ")):
            assert named <= (options(verb) if verb in VERBS else everywhere), f"{cell} of {verb}"


def test_terms_by_name_only_are_said_to_be() -> None:
    """As the register of terms has it."""
    for table, by_name in zip(sections("scene")["terms"].split("\nOnly by name:\n"), (False, True), strict=True):
        names = in_backticks("\n".join(re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)))
        assert names and {TERMS[name].on_request for name in names} == {by_name}


def errors() -> list[type[eomgen.EomgenError]]:
    found = [getattr(eomgen, name) for name in eomgen.__all__ if name.endswith("Error") and name != "EomgenError"]
    assert len(found) == 6
    return found


def test_every_public_name_is_on_the_python_page() -> None:
    page = whole("python")
    assert [name for name in eomgen.__all__ if not name.startswith("_") and not re.search(rf"\b{name}\b", page)] == []
    for error in errors():
        assert f"| `{error.__name__}` | {error.exit_code} |" in page


def test_files_on_the_pages_of_architecture_and_theory_exist() -> None:
    folders = ("eomgen", "templates", "tests", "docs", "examples", "benchmarks")
    there = [str(file.relative_to(ROOT)) for folder in folders for file in (ROOT / folder).rglob("*") if file.is_file()]
    named = set(re.findall(r"`([\w./-]+\.(?:py|pyi|jinja|js|md|svg|json))`", INSIDE))
    assert len(named) > 150
    assert sorted(name for name in named if not any(f"/{file}".endswith(f"/{name}") for file in there)) == []


def _house() -> list[tuple[list[str], list[str]]]:
    """Return the rooms of each row of the table of rooms, and the names in its text."""
    table = PAGES["architecture.md"].partition("| room | content |\n")[2].partition("\n\n")[0]
    cells = [line.strip("|").split("|", 1) for line in table.splitlines()[1:]]
    return [(re.findall(r"`([^`]+)`", rooms), re.findall(r"`([\w/]+)`", text)) for rooms, text in cells]


@cache
def _written(package: Path) -> dict[Path, str]:
    """Return the text of each file of the package."""
    return {file: file.read_text(encoding="utf-8") for file in (*package.rglob("*.py"), *package.rglob("*.pyi"))}


@cache
def _paths(package: Path) -> set[str]:
    """Return the files and folders of the package and of the templates, without endings."""
    paths = {f"/{path.relative_to(package.parent).with_suffix('')}" for path in _written(package)}
    paths |= {f"/{path.relative_to(ROOT)}" for path in ROOT.joinpath("templates").rglob("*")}
    return paths | {str(Path(path).parent) for path in paths}


def _strangers(rooms: list[str], names: list[str], package: Path = Path(eomgen.__file__).parent) -> list[str]:
    """Return the names that are neither modules, functions and classes of the rooms, nor paths or classes of all."""
    texts, paths = _written(package), _paths(package)
    folders = tuple(f"{package / room}/" for room in rooms)
    inside = [file for file in texts if str(file).startswith(folders)]
    parts = {part for file in inside for part in file.relative_to(package).with_suffix("").parts}
    written = "\n".join(texts[file] for file in inside)
    everywhere = "\n".join(texts.values())
    return [
        name
        for name in names
        if name not in parts
        and not re.search(rf"^(def|class) {re.escape(name)}\b", written, re.MULTILINE)
        and not (name[0].isupper() and re.search(rf"^class {name}\b", everywhere, re.MULTILINE))
        and not any(path.endswith(f"/{name}") for path in paths if "/" in name or path == f"/eomgen/{name}")
    ]


def test_rooms_of_the_house_and_their_parts_exist() -> None:
    rows = _house()
    named = {room.replace("/", ".") for rooms, _ in rows for room in rooms}
    assert {name for name in named if not any(room == name for room in DOORS) and name.count(".") == 0} == set()
    missing = {room for room in DOORS if not any(name == room or name.startswith(f"{room}.") for name in named)}
    stubs = {"products.exported", "products.model_methods", "products.solution_methods"}
    assert missing == {"__main__", "products.offered", *stubs}
    assert _strangers([], sorted({room for rooms, _ in rows for room in rooms})) == []
    assert [(rooms, wrong) for rooms, names in rows if (wrong := _strangers(rooms, names))] == []


def test_paths_on_the_pages_of_architecture_and_theory_exist() -> None:
    """Folders and modules without ending; ``<family>`` and the like stand for any name."""
    package = Path(eomgen.__file__).parent
    folders = [package, *(ROOT / name for name in ("templates", "tests", "docs", "examples", "benchmarks"))]
    paths = [f"/{path.relative_to(ROOT)}" for folder in folders for path in (folder, *folder.rglob("*"))]
    text = "\n".join([*paths, *(path.rpartition(".")[0] for path in paths)])
    wrong = []
    for name in sorted(set(re.findall(r"`([\w.*<>-]+/[\w./*<>-]*)`", INSIDE))):
        module = name if re.search(r"\.(py|pyi|jinja|js|md|svg|json)$", name) else re.sub(r"\.\w+$", "", name)
        pattern = re.sub(r"<\w+>|\\\*", r"[^/\n]+", re.escape(module.rstrip("/")))
        if not re.search(rf"/{pattern}$", text, re.MULTILINE):
            wrong.append(name)
    assert wrong == []


@pytest.mark.parametrize("page", PAGES)
def test_rows_of_tables_have_the_cells_of_their_heads(page: str) -> None:
    columns, wrong = 0, []
    for number, line in enumerate(PAGES[page].splitlines(), 1):
        cells = len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else 0
        if columns and cells not in (0, columns):
            wrong.append(f"line {number}: {line[:60]}")
        columns = (columns or cells) if cells else 0
    assert not wrong


@cache
def built() -> set[str]:
    """Return the files that a build of the site makes."""
    return {*BUILT, *built_pictures()}


@cache
def anchors_of(path: Path) -> set[str]:
    """Return the places of a page that a link can name."""
    text = path.read_text(encoding="utf-8")
    headings = {heading.lower().replace(" ", "-") for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
    return headings | set(re.findall(r'<a id="([^"]+)">', text))


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    source = ROOT / page if page == "README.md" else ROOT / "docs" / page
    for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", PAGES[page]):
        file, _, anchor = target.partition("#")
        path = source.parent / file if file else source
        if os.path.relpath(path, ROOT) in built():
            continue
        assert path.exists(), f"{page}: {target} is not there"
        assert not anchor or anchor in anchors_of(path), f"{page}: no heading for {target}"
