"""Upkeep of the catalogue of messages, ``eomgen/base/message_rows``: ``python -m tests.messages``.

The number of a line is the code, so lines are added at the end and never move. A message whose source gives its code
stands in the line of this code, in the words of the source. Any other message that was reworded keeps its line: its new
pattern is the one of the same room that is most alike. The line of a message that is gone becomes empty.
"""

from __future__ import annotations

import ast
import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

from eomgen.base.message_codes import FILES, FOLDER, KINDS, Row, rows
from tests.failures.catalogue import CHAPTERS
from tests.failures.errors_page import shown_entry
from tests.messages.answers import code_of_line
from tests.messages.extraction import HOLE, Function, Module, Site, Source, called, filled, letters

COMMAND = "python -m tests.messages"
#: Letters of a pattern at least.
_LEAST = 6
#: Characters of an example at most.
_LONGEST_EXAMPLE = 420
#: Lines of one file: a file of a wheel is small.
_LINES = 850
#: Characters of a remedy at most that is kept: a longer one belongs to one case.
_LONGEST = 60
#: Ratio from which two patterns are one message in other words.
_ALIKE = 0.72
_ERRORS = {
    "UsageError": "u", "DescriptionError": "d", "ModelError": "m", "ToolchainError": "t", "NumericalError": "n",
    "FileError": "f",
}  # fmt: skip  # a table
#: Errors that carry a text to a ``Problem``, and the place of this text among their arguments.
_CARRIERS = {
    "MeshError": 1, "TableError": 1, "OptionError": 1, "SmoothingError": 0, "IntegrationError": 0, "PathEndError": 0,
}  # fmt: skip  # a table
#: Rows of kinds, by exit code.
GENERAL = ("internal error", *(f"{KINDS[letter]} without a row of its own" for letter in "udmtnf"))
#: Messages that are made by Python's and click's libraries, with kind and room.
FOREIGN: tuple[tuple[str, str, str], ...] = (
    *(("u", "cli", text) for text in (
        "no such option {}", "missing option {}", "missing argument {}", "missing parameter{}",
        "invalid value for {}: {}", "invalid value for {}: {} is not one of {}",
        "invalid value for {}: {} is not a valid integer{}", "invalid value for {}: {} is not a valid float{}",
        "invalid value for {}: {} is not in the range {}", "invalid value for {}: path {} does not exist",
        "invalid value for {}: {} is a directory", "invalid value for {}: {} is a file",
        "got unexpected extra argument{}", "option {} requires an argument", "option {} does not take a value",
        "option {} requires {} arguments",
    )),
    *(("f", "base.files", text) for text in (
        "No space left on device", "Permission denied", "Is a directory", "Not a directory", "File exists",
        "Read-only file system", "No such file or directory", "Too many open files", "File name too long",
        "Disk quota exceeded", "Input/output error", "Operation not permitted",
    )),
    *(("d", "scene.document", text) for text in ()),
)  # fmt: skip  # tables


@cache
def sites(source: Source) -> list[Site]:
    """Return all places that make a message, in the order of modules and lines."""
    made = [*_problems(source), *_reports(source), *_rules(source), *_notes(source)]
    return sorted(made, key=_place)


def _place(site: Site) -> tuple[bool, str, int]:
    """Return the sort key of a place: the core comes before the readers of robots, which share messages with it."""
    return site.module.startswith("eomgen.products.robots"), site.module, site.line


def _problems(source: Source) -> Iterable[Site]:
    for module in source.modules.values():
        for name, calls in module.calls.items():
            if name == "Problem":
                for call, owner in calls:
                    kind = _kind_of(source, call, module)
                    yield _site(source, call, owner, module, kind, *_given(call, 1, "what", "hint"))
            elif source.descends(name, "EomgenError") or name in _CARRIERS:
                place = _CARRIERS.get(name, 0)
                for call, owner in calls:
                    if len(call.args) > place and not _made_of_problems(call.args[place]):
                        kind = _letter(source, name) or _kind_of(source, call, module)
                        yield _site(source, call, owner, module, kind, *_given(call, place, "problems", "hint"))


def _reports(source: Source) -> Iterable[Site]:
    for module in source.modules.values():
        for call, owner in module.calls.get("refuse", ()):
            if module.name.startswith(
                ("eomgen.scene", "eomgen.products.robots")
            ):  # of a place and a key, of an element, of an actuator
                place = 2 if len(call.args) > 3 else len(call.args) > 2 or ".sdf." in module.name
                yield _site(source, call, owner, module, "d", *_given(call, int(place), "fault", "hint"))
        for name, place in (("add", 1), ("add_at", 2), ("add_place", 3)):
            for call, owner in module.calls.get(name, ()):
                receiver = call.func.value if isinstance(call.func, ast.Attribute) else None
                if module.name.startswith("tests.fmu.checks"):
                    continue  # rules of an archive, of which users see a list
                if receiver is not None and called(receiver).endswith("report") and len(call.args) > place - 1:
                    yield _site(source, call, owner, module, "d", *_given(call, place, "fault", "hint"))


def _rules(source: Source) -> Iterable[Site]:
    """Yield the rules of values: tuples of a test, words and a remedy, and rows of the table of rules."""
    for module in source.modules.values():
        for kind, place in source.fields["words"]:
            for call, owner in module.calls.get(kind, ()):
                what, hint = _given(call, place, "words", "hint")
                if what is not None and module.name.startswith(("eomgen.scene", "eomgen.products")):
                    yield _site(source, call, owner, module, "d", what, hint, places=True)
        for node in ast.walk(module.tree):
            if not isinstance(node, ast.Tuple) or len(node.elts) != 3:
                continue
            test, words, hint = node.elts
            name = called(test.func if isinstance(test, ast.Call) else test)
            tested = isinstance(test, ast.Lambda) or (bool(name) and _is_test(source, name, module))
            if tested and isinstance(words, ast.Constant | ast.JoinedStr | ast.Lambda | ast.Name):
                yield _site(source, node, source.owner.get(node), module, "d", words, hint, places=True)


def _is_test(source: Source, name: str, module: Module) -> bool:
    if not module.name.startswith(("eomgen.scene", "eomgen.products")):
        return False
    rules = source.modules.get("eomgen.scene.reading.requirements")
    own = any(called(one.returns) == "Flags" for one in module.functions.get(name, ()) if one.returns is not None)
    return own or name == "Outside" or (rules is not None and name in rules.functions)


def _notes(source: Source) -> Iterable[Site]:
    """Yield the places that make a note of a scene or a system, or a warning."""
    for module in source.modules.values():
        for call, owner in (*module.calls.get("warn", ()), *module.calls.get("say_note", ())):
            if call.args:
                yield _site(source, call, owner, module, "w", call.args[0], None)
        for call, owner in module.calls.get("leave_out", ()):
            if len(call.args) > 1:
                yield _site(source, call, owner, module, "w", call.args[1], None)
        for call, owner in module.calls.get("append", ()):
            receiver = called(call.func.value) if isinstance(call.func, ast.Attribute) else ""
            if receiver in ("notes", "_notes", "warnings") or (owner is not None and _makes_notes(owner, module)):
                for part in _elements(call.args[0]):
                    yield _site(source, call, owner, module, "w", part, None)
        for call, owner in module.calls.get("note", ()):
            if call.args and module.name.startswith(("eomgen.scene", "eomgen.products")):
                yield _site(source, call, owner, module, "w", call.args[0], None)
        for node in ast.walk(module.tree):
            owner = source.owner.get(node)
            if isinstance(node, ast.AugAssign) and called(node.target).endswith("notes"):
                for part in _elements(node.value):
                    yield _site(source, part, owner, module, "w", part, None)
            elif isinstance(node, Function) and _makes_notes(node, module):
                for inner in ast.walk(node):
                    if isinstance(inner, ast.Yield | ast.YieldFrom | ast.Return) and inner.value is not None:
                        for part in _elements(inner.value):
                            yield _site(source, part, node, module, "w", part, None)


#: Names of functions that return or yield notes.
_OF_NOTES = re.compile(
    r"_?notes?(_of_\w+)?|\w+_(notes|warnings|doubts)|_?doubtful_\w+|(left_)?out(_of_scale)?|_?unused_\w+|angles_\w+|"
    r"lengths_\w+|negative_laws|springs_within_\w+|shapes_that_\w+|efforts_on_\w+|loads_without_\w+|springs_without_\w+|tyres_in_\w+|passed"
)


def _makes_notes(function: ast.AST, module: Module) -> bool:
    name = getattr(function, "name", "")
    if not module.name.startswith(("eomgen.scene", "eomgen.products", "eomgen.analysis")):
        return False
    return _OF_NOTES.fullmatch(name) is not None or name in _rows_of_notes(module)


def _rows_of_notes(module: Module) -> set[str]:
    """Return the functions that rows of the register of notes name in a module."""
    names: set[str] = set()
    for call, _ in module.calls.get("Note", ()):
        for part in ast.walk(call):
            if isinstance(part, ast.Name):
                names.add(part.id)
    return names


def _elements(value: ast.expr) -> list[ast.expr]:
    if isinstance(value, ast.Tuple | ast.List):
        return [part for one in value.elts for part in _elements(one)]
    if isinstance(value, ast.ListComp | ast.GeneratorExp):
        return [value.elt]
    if isinstance(value, ast.IfExp):
        return [*_elements(value.body), *_elements(value.orelse)]
    return [value]


def _given(call: ast.Call, place: int, name: str, hint: str) -> tuple[ast.expr | None, ast.expr | None]:
    starred = next((at for at, it in enumerate(call.args[: place + 2]) if isinstance(it, ast.Starred)), None)
    if starred is not None:
        parts = call.args[starred]
        assert isinstance(parts, ast.Starred)
        what = ast.Subscript(parts.value, ast.Constant(place - starred)) if starred <= place else call.args[place]
        return what, ast.Subscript(parts.value, ast.Constant(place + 1 - starred))
    by_name = {word.arg: word.value for word in call.keywords}
    what = call.args[place] if len(call.args) > place else by_name.get(name)
    return what, call.args[place + 1] if len(call.args) > place + 1 else by_name.get(hint)


def _made_of_problems(node: ast.expr) -> bool:
    if isinstance(node, ast.List | ast.ListComp | ast.Tuple):
        return True
    return isinstance(node, ast.Call) and called(node.func) == "Problem"


def _letter(source: Source, name: str) -> str:
    return next((letter for kind, letter in _ERRORS.items() if source.descends(name, kind)), "")


def _kind_of(source: Source, call: ast.Call, module: Module) -> str:
    """Return the letter of the error around a problem; of problems that are collected, that of the room."""
    node: ast.AST | None = call
    while node is not None and not isinstance(node, ast.stmt):
        if isinstance(node, ast.Call) and (letter := _letter(source, called(node.func))):
            return letter
        node = source.parent.get(node)
    return "d" if module.name.startswith("eomgen.scene") else "u"


def _site(
    source: Source, node: ast.expr, owner: Function | None, module: Module, kind: str,
    what: ast.expr | None, hint: ast.expr | None, *, places: bool = False,
) -> Site:  # fmt: skip  # two groups of arguments
    texts = [filled(text) if places else text for text in source.texts(what, owner, module)]
    texts = [text for text in texts if _is_message(text, kind)]
    hints = [text for text in source.texts(hint, owner, module) if letters(text) >= _LEAST] if hint else []
    hints = hints if len(hints) == 1 and len(hints[0]) <= _LONGEST else []
    return Site(
        module.name, node.lineno, kind, general(map(_pattern, texts)), general(map(_pattern, hints)),
        ast.unparse(what) if what else "", _code(node),
    )  # fmt: skip


def _code(node: ast.expr) -> str:
    """Return the code that a call gives for its message."""
    words = node.keywords if isinstance(node, ast.Call) else []
    given = [word.value for word in words if word.arg in ("row", "code")]
    return next((str(value.value) for value in given if isinstance(value, ast.Constant)), "")


def _is_message(text: str, kind: str) -> bool:
    """Return whether a text has words of a message: code in C, markup and names have none."""
    literal = text.replace(HOLE, " ")
    if letters(text) < _LEAST or re.search(r"\b(eg|EG)_|sizeof|\(double\)|</|\$\$|^[\W\d]*element$", literal):
        return False
    return kind != "w" or len(re.findall(r"[A-Za-z]{2,}", literal)) >= (2 if text.startswith("not ") else 3)


def _pattern(text: str) -> str:
    text = re.sub(f"{HOLE}+", "{}", text.strip())
    return text.replace("\t", " ").replace("\n", "\\n")


def general(patterns: Iterable[str]) -> tuple[str, ...]:
    """Return patterns without the ones that another pattern of the same place covers."""
    made = list(dict.fromkeys(patterns))
    regexes = {one: re.compile(".*".join(map(re.escape, one.split("{}"))), re.DOTALL) for one in made}
    return tuple(
        one
        for one in made
        if not any(other != one and regexes[other].fullmatch(one) and letters(other) >= 2 * _LEAST for other in made)
    )


def room_of(module: str) -> str:
    """Return the room of a module: two names, three in products and scenes."""
    parts = module.split(".")[1:]
    return ".".join(parts[: 3 if parts[:1] in (["products"], ["scene"]) else 2]) or "eomgen"


def findings() -> list[str]:
    """Return the names of all checks of runs."""
    from eomgen.simulation.judgement.register import CHECKS

    return [check.name for check in CHECKS]


def messages(source: Source) -> dict[tuple[str, str], tuple[str, str, str]]:
    """Return kinds, room and remedy of each message by its letter, E or W, and pattern."""
    made: dict[tuple[str, str], tuple[str, str, str]] = {}

    def add(letter: str, kind: str, room: str, pattern: str, hints: Sequence[str] = ()) -> None:
        kinds, first, known = made.get((letter, pattern), ("", room, "" if len(hints) != 1 else hints[0]))
        remedy = known if list(hints) == [known] else ""
        made[letter, pattern] = (kinds if kind in kinds else kinds + kind, first, remedy)

    for place, text in enumerate(GENERAL):
        add("E", "iudmtnf"[place], "errors", text)
    for kind, room, pattern in FOREIGN:
        add("E", kind, room, pattern)
    for site in sites(source):
        for pattern in site.patterns:
            add("W" if site.kind == "w" else "E", site.kind, room_of(site.module), pattern, site.hints)
    for name in findings():
        add("W", "r", "simulation.judgement", name)
    return made


def given_codes(source: Source) -> dict[str, str]:
    """Return the patterns of the messages whose sources give a code, by code."""
    return {site.code: site.patterns[0] for site in sites(source) if site.code and site.patterns}


def renewed(known: Sequence[Row], source: Source) -> dict[str, list[str]]:
    """Return the lines of the catalogue by letter for the present source; known messages keep their lines."""
    now, given, made = messages(source), given_codes(source), dict[str, list[str]]()
    for letter in FILES:
        wanted = {pattern: row for (one, pattern), row in now.items() if one == letter}
        before = {int(row.code[1:]): row for row in known if row.code[0] == letter}
        kept = {number: row.pattern.replace("\n", "\\n") for number, row in before.items()}
        kept |= {int(code[1:]): pattern for code, pattern in given.items() if code[0] == letter}
        fresh = [pattern for pattern in wanted if pattern not in kept.values()]
        for number, pattern in kept.items():
            if pattern not in wanted:
                alike = [other for other in fresh if wanted[other][1] == before[number].room]
                found = difflib.get_close_matches(pattern, alike, n=1, cutoff=_ALIKE)
                kept[number] = "".join(found)
                fresh = [other for other in fresh if other not in found]
        patterns = [kept.get(number, "") for number in range(1, max(kept, default=0) + 1)]
        made[letter] = _lines([*patterns, *fresh], wanted)
    return made


def _lines(patterns: Sequence[str], rows: Mapping[str, tuple[str, str, str]]) -> list[str]:
    """Return the lines of patterns; each room is written once for the rows that follow one another."""
    lines, above = list[str](), ""
    for pattern in patterns:
        kinds, room, remedy = rows.get(pattern, ("", "", ""))
        lines.append("\t".join((kinds, "" if room == above else room, pattern, remedy)).rstrip("\t"))
        above = room or above
    return lines


def examples() -> str:
    """Return the examples of codes: entries of the catalogue of bad inputs with their answers, one for each code."""
    made: list[str] = []
    known: set[str] = set()
    for _, _, entries in CHAPTERS:
        for entry in entries:
            codes = filter(None, map(code_of_line, entry.message.splitlines()))
            fresh = [code for code in dict.fromkeys(codes) if code not in known]
            text = shown_entry(entry)
            if fresh and len(text) <= _LONGEST_EXAMPLE:
                known.update(fresh)
                made.append(f"= {','.join(fresh)} {entry.title}\n{text}\n")
    return "\n" + "\n".join(made)


def main() -> int:
    """Write the catalogue."""
    FOLDER.mkdir(exist_ok=True)
    for letter, lines in renewed(rows(), Source()).items():
        for start in range(0, len(lines), _LINES):
            file = FOLDER / f"{FILES[letter]}_{start // _LINES + 1}.txt"
            file.write_text("\n".join(lines[start : start + _LINES]) + "\n", encoding="utf-8")
        print(f"{letter}: {sum(map(bool, lines))} messages in {len(lines)} lines")
    rows.cache_clear()
    (FOLDER / "examples.txt").write_text(examples(), encoding="utf-8")
    return 0
