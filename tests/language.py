"""Counts of phrases that make texts hard to read, per package: ``python -m tests.language`` prints the table.

Counted are docstrings, comments, messages (string literals of three words or more) and identifiers of ``eomgen``,
comments of ``templates``, and the pages of ``docs`` without blocks of code. ``--update`` writes the numbers to
``tests/language_budget.json`` unless a sum over all packages is higher than before: texts may move between packages.
Numbers of pronouns, per 1000 words, are never raised.

``--anchors`` prints the frequencies of phrases in public docstrings and in all pages, next to other packages.
"""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUDGET = Path(__file__).with_name("language_budget.json")

#: Phrases that replace a noun of the field by a pronoun, or an "if" by a place; words of place for "after", "in
#: addition to" and "separately" (a wheel may stand behind an axle); "is no" for "is not a"; "tell" for "report".
PHRASES: Mapping[str, re.Pattern[str]] = {
    "what": re.compile(r"\bwhat\b(?![^.;\n]*\?)", re.IGNORECASE),
    "those of": re.compile(
        r"\b(?:those|that) (?:of|by|from|in|with|at|on)\b|\bthose (?:that|which|who)\b", re.IGNORECASE
    ),
    "where": re.compile(r"\bwhere\b", re.IGNORECASE),
    "Return what": re.compile(r"\bReturns? (?:what|which|where|those|that|how|who)\b"),
    "nothing": re.compile(r"\b(?:nothing|nobody|whatever|whom)\b", re.IGNORECASE),
    "Return it": re.compile(r"\bReturns? (?:the same|its|it|one of|them|their)\b"),
    "beside": re.compile(r"\bbeside\b", re.IGNORECASE),
    "behind": re.compile(r"\bbehind\b", re.IGNORECASE),
    "apart": re.compile(r"\bapart\b(?!\s+from\b)", re.IGNORECASE),
    "is no": re.compile(r"(?<!there )\b(?:is|are)\s+no\b(?!\s+(?:longer|more)\b)", re.IGNORECASE),
    "tell": re.compile(r"\b(?:tells?|told)\b", re.IGNORECASE),
}
#: A phrase of two words or more that follows itself, as a faulty replacement leaves it; behind a full stop only if the
#: phrase is all that follows.
_REPEATED = re.compile(r"\b([^\W\d]\w*(?:[,;:]? \w+){1,10})(?: \1\b|\. \1(?=[.;]|$))")
#: Pronouns, which belong to plain English but replace nouns if they are many: compared per 1000 words.
PRONOUNS: Mapping[str, re.Pattern[str]] = {
    "it": re.compile(r"\b(?:it|its|itself)\b", re.IGNORECASE),
    "they": re.compile(r"\b(?:they|them|their|theirs|themselves)\b", re.IGNORECASE),
    "one": re.compile(r"\b(?:the|that|this|these|those|own|first|last|next|each|given|such) ones?\b", re.IGNORECASE),
    "others": re.compile(r"\b(?:others|the other)\b", re.IGNORECASE),
}
#: Steps of allowed numbers per 1000 words; by how much a package may exceed the number, since words move.
_STEP, _SLACK = 0.5, 1.0
#: Phrases of which other packages have few: pattern, and the largest number per 1000 words of docstrings in diffrax,
#: SymPy's mechanics, symforce, python-control and scipy.integrate.
ANCHORS: Mapping[str, tuple[re.Pattern[str], float]] = {
    name: (re.compile(pattern, re.IGNORECASE), most)
    for name, pattern, most in (
        ("what", r"\bwhat\b(?![^.;\n]*\?)", 0.51),
        ("of what", r"\b(?:of|by|from|in) what\b", 0.06),
        ("those of", r"\b(?:those|that) (?:of|by)\b|\bthose that\b", 0.10),
        ("where", r"\bwhere\b", 1.92),
        ("nothing", r"\b(?:nothing|nobody|whatever|whom)\b", 0.14),
        ("beside", r"\b(?:besides?|behind|beyond|apart)\b", 0.31),
    )
}
#: Allowed number by the largest of other packages.
ALLOWED = 1.5
#: Identifiers that name no concept.
NAMES = ("what", "found")
COLUMNS = ("words", *PHRASES, "repeated", *PRONOUNS, *(f"name {name}" for name in NAMES))
#: The strings and comments of a file; a comment within a string is part of it, and a string within a comment likewise.
_STRING_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|\'\'\'(?:\\.|[^\\])*?\'\'\'|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|(#[^\n]*)''',
    re.DOTALL,
)
_WORD = re.compile(r"[A-Za-z']+")
#: Names of arguments at the heads of descriptions in a docstring: identifiers, not words.
_ARGUMENTS = re.compile(r"^\s*\w+(?:, \w+)* : (?=\S)", re.MULTILINE)
_BLOCK = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
#: A blank line: paragraphs and headings are texts of their own.
_PARAGRAPH = re.compile(r"\n\s*\n")
_JINJA_COMMENT = re.compile(r"\{#.*?#\}|/\*.*?\*/|//[^\n]*", re.DOTALL)


def comments(source: str) -> Iterator[str]:
    """Yield the comments of a file. Strings of Python 3.11 have no quotes of their own kind within them."""
    return (match[1] for match in _STRING_OR_COMMENT.finditer(source) if match[1])


def of_python(source: str) -> tuple[list[str], list[str]]:
    """Return comments, docstrings and string literals of three words or more, and each occurrence of a variable, an
    argument, an attribute or a function name."""
    return of_nodes(source, ast.walk(ast.parse(source)))


def of_nodes(source: str, nodes: Iterable[ast.AST]) -> tuple[list[str], list[str]]:
    """Return the same by the nodes of the source."""
    texts, names = list(comments(source)), []
    for node in nodes:
        match node:
            case ast.Constant(value=str(text)) if text.count(" ") >= 2:
                texts.append(text)
            case ast.Name(id=name) | ast.arg(arg=name) | ast.Attribute(attr=name) | ast.FunctionDef(name=name):
                names.append(name)
    return texts, names


def texts_and_names(file: Path) -> tuple[list[str], list[str]]:
    """Return the texts and the identifiers of a Python file, or the texts of a template or a page."""
    if file.is_relative_to(ROOT / "eomgen"):
        from tests.syntax import facts  # gathers facts by this module

        return list(facts()[file].texts), list(facts()[file].names)
    source = file.read_text(encoding="utf-8")
    if file.suffix == ".py":
        return of_python(source)
    return (_PARAGRAPH.split(_BLOCK.sub("", source)) if file.suffix == ".md" else _JINJA_COMMENT.findall(source)), []


def repetitions(text: str) -> list[str]:
    """Return the phrases of a text that follow themselves, also across ends of lines."""
    return [match[0] for match in _REPEATED.finditer(" ".join(text.split()))]


def files_of_packages() -> dict[str, list[Path]]:
    """Return the counted files of each entry of the first floor of ``eomgen``, of each product, of the templates and of
    the pages."""
    packages: dict[str, list[Path]] = {}
    for file in sorted((ROOT / "eomgen").rglob("*.py")):
        parts = file.relative_to(ROOT / "eomgen").parts
        name = ".".join(parts[: 2 if parts[0] == "products" else 1]).removesuffix(".py")
        packages.setdefault(name, []).append(file)
    packages["(templates)"] = sorted((ROOT / "templates").rglob("*.jinja"))
    packages["(pages)"] = [
        ROOT / "README.md",
        *sorted(file for file in (ROOT / "docs").glob("*.md") if file.stem not in ("errors", "modules")),
        *(
            page
            for folder in ("scene", "python", "command_line", "theory", "contributing")
            for page in sorted((ROOT / "docs" / folder).glob("*.md"))
        ),
    ]
    return packages


def counts_of(files: list[Path]) -> dict[str, int]:
    """Return the number of words, of each phrase and of each name in some files."""
    counts = dict.fromkeys(COLUMNS, 0)
    for file in files:
        texts, names = texts_and_names(file)
        for text in texts:
            counts["words"] += len(_WORD.findall(text))
            counts["repeated"] += len(repetitions(text))
            without_names = _ARGUMENTS.sub("", text)
            for phrase, pattern in {**PHRASES, **PRONOUNS}.items():
                counts[phrase] += len(pattern.findall(without_names))
        for name in NAMES:
            counts[f"name {name}"] += names.count(name)
    return counts


def counts() -> dict[str, dict[str, int]]:
    """Return the counts of each package."""
    return {package: counts_of(files) for package, files in files_of_packages().items()}


def budget() -> dict[str, dict[str, float]]:
    """Return the largest numbers allowed; a package or phrase that is not listed has none."""
    table: dict[str, dict[str, float]] = json.loads(BUDGET.read_text(encoding="utf-8"))
    return table


def measures(row: Mapping[str, float]) -> dict[str, float]:
    """Return the numbers that have a budget: counts of phrases and names, pronouns per 1000 words, rounded up."""
    per_thousand = {name: 1000.0 * row.get(name, 0) / max(row["words"], 1) for name in PRONOUNS}
    rounded = {name: _STEP * math.ceil(value / _STEP) for name, value in per_thousand.items()}
    return {**{name: count for name, count in row.items() if name != "words"}, **rounded}


def lowered(measured: Mapping[str, float], allowed: Mapping[str, float]) -> dict[str, float]:
    """Return the next budget of a package: measured numbers, of pronouns never more than before."""
    kept = {
        name: min(value, allowed.get(name, value)) if name in PRONOUNS else value for name, value in measured.items()
    }
    return {name: value for name, value in kept.items() if value}


def excesses(now: Mapping[str, Mapping[str, float]], allowed: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return a line for each number above its budget."""
    return [
        f'{package}: {value:g} of "{phrase}"{" per 1000 words" * (phrase in PRONOUNS)}, {most:g} allowed'
        for package, row in now.items()
        for phrase, value in measures(row).items()
        if value > (most := allowed.get(package, {}).get(phrase, 0) + _SLACK * (phrase in PRONOUNS))
    ]


def total(table: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Return the sums of counts over all packages."""
    return {column: sum(row.get(column, 0) for row in table.values()) for column in COLUMNS}


def places(phrase: str, package: str) -> Iterator[str]:
    """Yield the lines of a package with a phrase, by file and line; also lines of code with the phrase in a string."""
    for file in files_of_packages()[package]:
        if phrase == "repeated":
            yield from (
                f"{file.relative_to(ROOT)}: {one}" for text in texts_and_names(file)[0] for one in repetitions(text)
            )
            continue
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
            if {**PHRASES, **PRONOUNS}[phrase].search(line):
                yield f"{file.relative_to(ROOT)}:{number}: {line.strip()}"


def table(now: Mapping[str, Mapping[str, int]]) -> str:
    """Return counts, and their number per 1000 words in the last line, as a table."""
    sums = total(now)
    columns = list(sums)
    lines = [f"{'package':<22}" + "".join(f"{column:>13}" for column in columns)]
    lines += [
        f"{package:<22}" + "".join(f"{row[column]:>13}" for column in columns)
        for package, row in (*sorted(now.items()), ("all", sums))
    ]
    shares = "".join(f"{1000.0 * sums[column] / sums['words']:>13.2f}" for column in columns)
    return "\n".join([*lines, f"{'per 1000 words':<22}{shares}"])


def public_texts() -> dict[str, list[str]]:
    """Return the docstrings of public names, all pages, and the pages of examples, without blocks of code."""
    from tests.docstrings import names  # imports all of the package and its products

    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return {
        "docstrings": [inspect.getdoc(value) or "" for _, value in names()],
        "pages": [_BLOCK.sub("", page.read_text(encoding="utf-8")) for page in pages if "_build" not in page.parts],
        "examples": [_BLOCK.sub("", page.read_text(encoding="utf-8")) for page in ROOT.glob("examples/*/README.md")],
    }


def per_thousand(texts: list[str]) -> dict[str, float]:
    """Return the number of each phrase of ``ANCHORS`` per 1000 words."""
    words = sum(len(_WORD.findall(text)) for text in texts)
    return {
        name: 1000.0 * sum(len(pattern.findall(text)) for text in texts) / words
        for name, (pattern, _) in ANCHORS.items()
    }


def main(arguments: list[str]) -> int:
    """Print the table, or the places of a phrase in a package, or write lower counts to the budget."""
    if len(arguments) == 2:
        print("\n".join(places(*arguments)))
        return 0
    if arguments == ["--anchors"]:
        measured = {name: per_thousand(texts) for name, texts in public_texts().items()}
        for name, (_, most) in ANCHORS.items():
            numbers = "".join(f"{label} {values[name]:.2f}, " for label, values in measured.items())
            print(f"{name:<10}{numbers}allowed {ALLOWED * most:.2f}")
        return 0
    now = counts()
    print(table(now))
    if arguments == ["--update"]:
        old = budget()
        sums = {name: value for name, value in total(now).items() if name not in PRONOUNS}
        if higher := excesses({"all": sums}, {"all": total(old)}):
            print("not written:", *higher, sep="\n")
            return 1
        kept = {package: lowered(measures(row), old.get(package, {})) for package, row in sorted(now.items())}
        BUDGET.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
