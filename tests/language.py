"""Counts of phrases that make texts hard to read; ``python -m tests.budgets`` prints the numbers and holds the budgets.

Counted are docstrings, comments, messages (string literals of three words or more) and identifiers of ``eomgen``,
comments of ``templates``, and the pages of ``docs`` without blocks of code.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]

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
#: A text of the package, comments aside, whose first sentence has "of" four times or more.
_CHAINED = re.compile(
    r"\A(?!#)(?:(?!\.\s|\n\s*\n|\bof\b).)*(?:\bof\b(?:(?!\.\s|\n\s*\n|\bof\b).)*){4}", re.IGNORECASE | re.DOTALL
)
#: Pronouns, which belong to plain English but replace nouns if they are many: compared per 1000 words.
PRONOUNS: Mapping[str, re.Pattern[str]] = {
    "it": re.compile(r"\b(?:it|its|itself)\b", re.IGNORECASE),
    "they": re.compile(r"\b(?:they|them|their|theirs|themselves)\b", re.IGNORECASE),
    "one": re.compile(r"\b(?:the|that|this|these|those|own|first|last|next|each|given|such) ones?\b", re.IGNORECASE),
    "others": re.compile(r"\b(?:others|the other)\b", re.IGNORECASE),
}
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
COLUMNS = ("words", *PHRASES, "repeated", "four of", *PRONOUNS, *(f"name {name}" for name in NAMES))
#: The strings and comments of a file; a comment within a string is part of it, and a string within a comment likewise.
_STRING_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|\'\'\'(?:\\.|[^\\])*?\'\'\'|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|(#[^\n]*)''',
    re.DOTALL,
)
_WORD = re.compile(r"[A-Za-z']+")
#: Names of arguments at the heads of descriptions in a docstring: identifiers, not words.
_ARGUMENTS = re.compile(r"^\s*\w+(?:, \w+)* : (?=\S)", re.MULTILINE)
#: Between texts that are searched at once: no phrase and no name of an argument goes across.
_BETWEEN = "\n\0\n"
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


def has_chain(text: str) -> bool:
    """Return whether the first sentence of a text has four words "of" or more."""
    return _CHAINED.match(text) is not None


def counted_files() -> list[Path]:
    """Return the modules of ``eomgen``, the templates and the pages."""
    pages = [
        ROOT / "README.md",
        *(file for file in (ROOT / "docs").glob("*.md") if file.stem not in ("errors", "modules")),
        *(
            page
            for folder in ("scene", "python", "command_line", "theory", "contributing")
            for page in (ROOT / "docs" / folder).glob("*.md")
        ),
    ]
    return sorted([*(ROOT / "eomgen").rglob("*.py"), *(ROOT / "templates").rglob("*.jinja"), *pages])


def counts_of(files: list[Path]) -> dict[str, int]:
    """Return the number of words, of each phrase and of each name in some files."""
    counts = dict.fromkeys(COLUMNS, 0)
    for file in files:
        texts, names = texts_and_names(file)
        for text in texts:
            counts["words"] += len(_WORD.findall(text))
            counts["repeated"] += len(repetitions(text))
            counts["four of"] += file.suffix == ".py" and has_chain(text)
        without_names = _ARGUMENTS.sub("", _BETWEEN.join(texts))
        for phrase, pattern in {**PHRASES, **PRONOUNS}.items():
            counts[phrase] += len(pattern.findall(without_names))
        for name in NAMES:
            counts[f"name {name}"] += names.count(name)
    return counts


def totals() -> dict[str, float]:
    """Return the numbers of phrases and names in all files, and of pronouns per 1000 words."""
    counts = counts_of(counted_files())
    rates = {name: math.ceil(10_000.0 * counts[name] / counts["words"]) / 10.0 for name in PRONOUNS}
    return {name: rates.get(name, number) for name, number in counts.items() if name != "words"}


def places(phrase: str) -> Iterator[str]:
    """Yield the lines with a phrase, by file and line; also lines of code with the phrase in a string."""
    for file in counted_files():
        if phrase == "repeated":
            yield from (
                f"{file.relative_to(ROOT)}: {one}" for text in texts_and_names(file)[0] for one in repetitions(text)
            )
            continue
        if phrase == "four of":
            texts = texts_and_names(file)[0] if file.suffix == ".py" else ()
            yield from (f"{file.relative_to(ROOT)}: {text.partition('. ')[0]}" for text in texts if has_chain(text))
            continue
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
            if {**PHRASES, **PRONOUNS}[phrase].search(line):
                yield f"{file.relative_to(ROOT)}:{number}: {line.strip()}"


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


def anchors() -> Iterator[str]:
    """Yield the frequencies of phrases in public docstrings and pages, and the allowed ones."""
    measured = {name: per_thousand(texts) for name, texts in public_texts().items()}
    for name, (_, most) in ANCHORS.items():
        numbers = "".join(f"{label} {values[name]:.2f}, " for label, values in measured.items())
        yield f"{name:<10}{numbers}allowed {ALLOWED * most:.2f}"
