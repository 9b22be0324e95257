"""Weight of the package by rooms, and vague phrases of its texts: ``python -m tests.budgets`` prints both.

Counted are, per room of ``eomgen`` and per product:

- ``code``: lines of Python without docstrings, comments, blank lines and imports
- ``data``: lines of tables and other files beside the modules, without comments and blank lines
- ``templates``: lines of the templates of the room, without comments and blank lines
- ``constants``: numbers at module level outside tables
- ``participles``: functions named by a bare participle (``placed``) or ``_of_x``
- ``complex``: functions of a cyclomatic complexity above ``READABLE``

The budgets of the core only fall: ``--update`` writes the counts to ``tests/budgets.json`` if no sum over the core has
grown; code may move between rooms. A product grows with a reason, ``--update --why "fields: a new kind of document"``,
which is kept. Phrases of all texts only fall in number; pronouns per 1000 words, too. The shares of docstrings and of
blank lines of the core stay within a point; docstrings may grow by 3.5 (docs/contributing/decisions.md).

``--short`` lists functions of fewer than 8 lines with a single use, ``--phrase NAME`` the places of a phrase, and
``--anchors`` the frequencies of phrases in public docstrings and in all pages, next to other packages.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "eomgen"
BUDGET = Path(__file__).with_suffix(".json")
COLUMNS = ("code", "data", "templates", "constants", "participles", "complex")
#: Complexity from which a function counts as complex, and the highest of all functions.
READABLE, HIGHEST = 20, 30
#: Lines and uses of the functions that are reported.
SHORT, SINGLE = 8, 1
Function = ast.FunctionDef | ast.AsyncFunctionDef
Counts = dict[str, float]

_PARTICIPLE = re.compile(
    r"_*(?:[a-z]+(?<!e)ed|begun|bent|bound|built|drawn|driven|felt|found|given|gone|grown|held|hidden|kept|known|"
    r"laid|led|left|lost|made|meant|met|paid|proven|put|read|run|said|seen|sent|set|shown|sought|spent|spun|taken|told|"
    r"thrown|understood|woven|worn|written)"
)
#: Verbs and nouns that end like a participle, or are equal to one.
_NO_PARTICIPLES = frozenset(("bound", "embed", "led", "put", "read", "run", "seed", "set", "shed", "speed"))
_DECISIONS = re.compile(r"\b(?:if|for|while|else|except|and|or|assert|case)\b")  # each decision is written with one


# -- counts of a module ------------------------------------------------------------------------------------------------


def docstrings(nodes: Iterable[ast.AST]) -> Iterator[ast.Expr]:
    """Yield the docstrings of a module, its classes and functions, and texts behind attributes."""
    for node in nodes:
        for part in getattr(node, "body", ()) if isinstance(getattr(node, "body", ()), list) else ():
            if (
                isinstance(part, ast.Expr)
                and isinstance(part.value, ast.Constant)
                and isinstance(part.value.value, str)
            ):
                yield part


def line_counts(source: str, nodes: Collection[ast.AST]) -> Counts:
    """Return the numbers of all lines, of lines of code, of docstrings and of blank lines of a module."""
    lines = source.splitlines()
    blank = {number for number, line in enumerate(lines, 1) if not line.strip()}
    comments = {number for number, line in enumerate(lines, 1) if line.lstrip().startswith("#")}
    texts = set(_lines(docstrings(nodes)))
    imports = set(_lines(node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)))
    code = len(lines) - len(blank | comments | texts | imports)
    return {"lines": len(lines), "code": code, "docstrings": len(texts), "blank": len(blank - texts)}


def _lines(nodes: Iterable[ast.AST]) -> Iterator[int]:
    for node in nodes:
        yield from range(getattr(node, "lineno", 0), (getattr(node, "end_lineno", 0) or 0) + 1)


def constants(tree: ast.Module) -> int:
    """Return how many numbers have a name of their own at module level."""
    total = 0
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            parts = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            if isinstance(node.value, ast.Tuple) and not isinstance(target, ast.Tuple):
                continue  # a table
            total += sum(map(_is_number, parts))
    return total


def _is_number(node: ast.AST) -> bool:
    match node:
        case ast.Constant(value=value):
            return isinstance(value, int | float) and not isinstance(value, bool)
        case ast.UnaryOp(operand=operand):
            return _is_number(operand)
        case ast.BinOp(left=left, right=right):
            return _is_number(left) and _is_number(right)
    return False


def is_participle(name: str) -> bool:
    """Whether the name of a function is a bare participle or ``_of_x``, in place of a verb or the returned noun."""
    bare = name.strip("_")
    if name.startswith("__") or bare in _NO_PARTICIPLES:
        return False
    return bare.startswith("of_") or _PARTICIPLE.fullmatch(bare) is not None


def short_functions(source: str, tree: ast.Module) -> list[tuple[str, int]]:
    """Return the private functions of fewer than ``SHORT`` lines with their numbers of uses in the module."""
    uses = Counter(re.findall(r"[A-Za-z_]\w*", source))
    return [
        (name, uses[function.name] - 1)
        for name, function in functions(tree)
        if function.name.startswith("_")
        and not function.name.startswith("__")
        and (function.end_lineno or 0) - function.lineno + 1 < SHORT
    ]


# -- complexity --------------------------------------------------------------------------------------------------------


def _decisions(node: ast.AST) -> int:
    """Return the number of decisions that a node adds by itself, without its parts."""
    match node:
        case ast.If() | ast.IfExp() | ast.Assert():
            return 1
        case ast.For() | ast.AsyncFor() | ast.While():
            return 1 + bool(node.orelse)
        case ast.Try():
            return len(node.handlers) + bool(node.orelse)
        case ast.BoolOp():
            return len(node.values) - 1
        case ast.comprehension():
            return 1 + len(node.ifs)
        case ast.Match():
            rest = any(isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None for case in node.cases)
            return len(node.cases) - rest
    return 0


def complexity(function: Function) -> int:
    """Return the complexity of a function by the rules of radon, without functions and classes within it."""
    pending: list[ast.AST] = list(function.body)
    decisions = 0
    while pending:
        node = pending.pop()
        if isinstance(node, Function | ast.ClassDef):
            continue
        decisions += _decisions(node)
        if not isinstance(node, ast.Assert):  # radon counts no operands in it
            pending.extend(ast.iter_child_nodes(node))
    return 1 + decisions


def functions(node: ast.AST, scope: str = "") -> Iterator[tuple[str, Function]]:
    """Yield the functions below a node, at any depth of statements, with their qualified names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function | ast.ClassDef):
            name = f"{scope}.{child.name}" if scope else child.name
            if isinstance(child, Function):
                yield name, child
            yield from functions(child, name)
        elif isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from functions(child, scope)


def complex_functions(source: str, above: int, tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield the qualified name and the complexity of each function of a source that is more complex than a number."""
    if len(_DECISIONS.findall(source)) < above:
        return
    lines = source.splitlines()
    for name, function in functions(tree):
        text = "\n".join(lines[function.lineno - 1 : function.end_lineno])
        if len(_DECISIONS.findall(text)) >= above and (number := complexity(function)) > above:
            yield name, number


# -- counts of the package ---------------------------------------------------------------------------------------------


def room_of(parts: Sequence[str]) -> str:
    """Return the room of a file below ``eomgen`` or ``templates``, ``products.NAME`` for a product."""
    return ".".join(Path(part).stem for part in parts[: 2 if parts[0] == "products" else 1])


def is_core(room: str) -> bool:
    """Whether a room, or a folder of templates, belongs to no product."""
    return not room.startswith("products.")


def weights() -> dict[str, Counts]:
    """Return the counts of each room, and of each folder of templates."""
    from tests.syntax import facts  # gathers facts by this module

    rooms: dict[str, Counts] = {}

    def add(room: str, **counts: float) -> None:
        row = rooms.setdefault(room, dict.fromkeys(COLUMNS, 0))
        for name, number in counts.items():
            row[name] += number

    for file, row in facts().items():
        room = room_of(file.relative_to(PACKAGE).parts)
        if file.suffix == ".pyi":
            if file.parent != PACKAGE:  # else it has the names of a module elsewhere
                add(room, data=row.lines["code"])
            continue
        names = sum(map(is_participle, row.functions))
        add(room, code=row.lines["code"], constants=row.constants, participles=names, complex=len(row.complexities))
    for file in sorted(PACKAGE.rglob("*")):
        if file.suffix in (".toml", ".txt", ".json", ".jinja", ".c", ".h"):
            add(room_of(file.relative_to(PACKAGE).parts), data=_filled_lines(file))
    for file in sorted((ROOT / "templates").rglob("*")):
        if file.suffix in _TEMPLATES:
            folder = file.relative_to(ROOT / "templates").parts[0]
            add(_ROOMS.get(folder, f"products.{folder}"), templates=_filled_lines(file))
    return rooms


#: Endings of templates, beside which their bytecode lies.
_TEMPLATES = (".c", ".css", ".h", ".html", ".jinja", ".js", ".txt")
#: Rooms of folders of templates with another name.
_ROOMS = {"c": "codegen"}


def _filled_lines(file: Path) -> int:
    lines = (line.strip() for line in file.read_text(encoding="utf-8").splitlines())
    return sum(bool(line) and not line.startswith(("#", "//", "/*", "*", "{#")) for line in lines)


def shares() -> Counts:
    """Return the lines of docstrings and the blank lines of the core per 100 lines; products may be removed."""
    from tests.syntax import facts

    rows = [
        row.lines
        for file, row in facts().items()
        if file.suffix == ".py" and is_core(room_of(file.relative_to(PACKAGE).parts))
    ]
    lines = sum(row["lines"] for row in rows)
    return {name: round(100.0 * sum(row[name] for row in rows) / lines, 1) for name in ("docstrings", "blank")}


def core(rooms: Mapping[str, Counts]) -> Counts:
    """Return the sums over the core."""
    return _sum(row for room, row in rooms.items() if is_core(room))


def _sum(rows: Iterable[Counts]) -> Counts:
    total: Counts = dict.fromkeys(COLUMNS, 0)
    for row in rows:
        for name in COLUMNS:
            total[name] += row.get(name, 0)
    return total


@cache
def measured() -> dict[str, dict[str, Counts]]:
    """Return the counts of rooms, the numbers of phrases and the shares of lines."""
    from tests.language import totals

    return {"rooms": weights(), "phrases": {"all": totals()}, "shares": {"all": shares()}}


def allowed() -> dict[str, dict[str, Counts]]:
    """Return the budgets."""
    table: dict[str, dict[str, Counts]] = json.loads(BUDGET.read_text(encoding="utf-8"))
    return table


# -- comparison --------------------------------------------------------------------------------------------------------


def excesses(now: Mapping[str, Counts], most: Mapping[str, Counts]) -> list[str]:
    """Return a line for each number above its budget; a missing row or number allows nothing."""
    return [
        f"{row}: {value:g} {name}, {most.get(row, {}).get(name, 0):g} allowed"
        for row, counts in now.items()
        for name, value in counts.items()
        if value > most.get(row, {}).get(name, 0)
    ]


def refusals(now: Mapping[str, Counts], old: Mapping[str, Counts], whys: Collection[str]) -> list[str]:
    """Return why new counts of rooms cannot become the budget: growth of the core, or of a product without a reason."""
    grown = excesses({"core": core(now)}, {"core": core(old)})
    for room in sorted(now):
        if not is_core(room) and excesses({room: now[room]}, old) and room.removeprefix("products.") not in whys:
            grown += [
                f'{line}; --why "{room.removeprefix("products.")}: reason"' for line in excesses({room: now[room]}, old)
            ]
    return grown


def table(rooms: Mapping[str, Counts]) -> str:
    """Return the counts of all rooms as a table, heaviest first."""
    rows = sorted(rooms.items(), key=lambda item: (not is_core(item[0]), -item[1]["code"]))
    rows += [("core", core(rooms)), ("all", _sum(rooms.values()))]
    head = f"{'room':<28}" + "".join(f"{name:>12}" for name in COLUMNS)
    return "\n".join([head, *(f"{room:<28}" + "".join(f"{row[name]:>12g}" for name in COLUMNS) for room, row in rows)])


def main(*words: str) -> int:
    """Print the counts, or update the budgets."""
    from tests import language
    from tests.syntax import facts

    if words[:1] in (("--anchors",), ("--phrase",)):
        print("\n".join(language.anchors() if words[0] == "--anchors" else language.places(words[1])))
        return 0
    if words[:1] == ("--short",):
        for file, row in facts().items():
            print(*(f"{file.relative_to(ROOT)}::{name}" for name, uses in row.short if uses == SINGLE), sep="\n")
        return 0
    now = measured()
    print(table(now["rooms"]))
    for part in ("phrases", "shares"):
        print(f"{part}:", ", ".join(f"{name} {value:g}" for name, value in now[part]["all"].items()))
    if words[:1] != ("--update",):
        return 0
    old = allowed()
    whys = dict(text.split(": ", 1) for text in words[2:] if words[1] == "--why")
    removed = [room for room in old["rooms"] if room not in now["rooms"] and not is_core(room)]
    wordier = [] if removed else excesses(now["phrases"], old["phrases"])  # frequencies of the remaining words differ
    if refused := [*refusals(now["rooms"], old["rooms"], whys), *wordier]:
        print("not written:", *refused, sep="\n", file=sys.stderr)
        return 1
    reasons = {**old.get("why", {}), **{f"products.{name}": text for name, text in whys.items()}}
    kept = {
        "rooms": dict(sorted(now["rooms"].items())),
        "phrases": now["phrases"],
        "shares": old["shares"],
        "why": reasons,
    }
    BUDGET.write_text(_rows(kept), encoding="utf-8")
    return 0


def _rows(parts: Mapping[str, Mapping[str, object]]) -> str:
    """Return JSON with one row a line."""
    texts = (
        f' "{part}": {{\n'
        + ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in rows.items())
        + "\n }"
        for part, rows in parts.items()
    )
    return "{\n" + ",\n".join(texts) + "\n}\n"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
