"""Folding of long lines of C; names and numbers of a model decide their length, so templates cannot."""

from __future__ import annotations

import re

#: Characters in a line.
WIDTH = 120

#: Characters of a line that are looked at together.
_WINDOW = 4000

_INDENT = "    "
_COMMENT_LINE = re.compile(r"\s*(/\*|\*) ")
#: Places at which a line may end: behind a comma or an assignment, before an operator.
_BREAK = re.compile(
    r"(?<=,) (?=\S)|(?<= =) (?=\S)| (?=(?:&&|\|\||[+?:-]) )|(?<=:) (?=return )|(?<=[;{]) (?=return |\(void\))"
)
#: Tokens without breaks inside: texts and comments.
_CLOSED = re.compile(r'"(?:[^"\\]|\\.)*"|/\*.*?\*/')


def folded(text: str) -> str:
    """Return C text with no line longer than WIDTH, but for directives and texts that cannot be cut."""
    if all(len(line) <= WIDTH for line in text.split("\n")):
        return text
    pieces: list[str] = []
    within = False  # a comment that an earlier line began: a product may begin with a star, too
    for line in text.split("\n"):
        pieces += _pieces(line, within)
        opened, closed = line.rfind("/*"), line.rfind("*/")
        within = opened > closed or (within and closed < 0)
    return "\n".join(pieces)


def _pieces(line: str, within: bool = False) -> list[str]:
    if len(line) <= WIDTH or line.lstrip().startswith("#") or line.endswith("\\"):
        return [line]
    if _COMMENT_LINE.match(line) and (within or "/*" in line):
        return _folded_comment(line)
    indent = line[: len(line) - len(line.lstrip())]
    behind = re.search(r"\s*(/\*[^\"]*\*/)$", line)
    if behind and not re.search(r"\*/|/\*", line[: behind.start()]):
        return [*_pieces(indent + behind[1]), *_pieces(line[: behind.start()])]
    return _folded_code(line, indent + _INDENT)


def _folded_comment(line: str) -> list[str]:
    """Break between words; further lines begin with a star below the first one."""
    indent = line[: len(line) - len(line.lstrip())]
    prefix = f"{indent} * " if line.lstrip().startswith("/*") else f"{indent}* "
    pieces = []
    while len(line) > WIDTH:
        cut = line.rfind(" ", len(prefix) + 1, WIDTH + 1)
        if line[cut + 1 :] == "*/":
            cut = line.rfind(" ", len(prefix) + 1, cut)
        if cut < 0:
            break
        pieces.append(line[:cut].rstrip())
        line = prefix + line[cut + 1 :].lstrip()
    return [*pieces, line]


def _folded_code(line: str, indent: str) -> list[str]:
    """Break at the fewest open brackets, as late as possible with these, in the second half of the line if at all
    possible."""
    pieces = []
    line, rest = line[:_WINDOW], line[_WINDOW:]  # a table of numbers may be as long as a book: page by page
    while len(line) + len(rest) > WIDTH:
        head = line[: WIDTH + 2]
        marked = '"' in head or "/*" in head
        if rest and (marked or len(line) < WIDTH + 2):
            size = len(rest) if marked else _WINDOW
            line, rest = line + rest[:size], rest[size:]
            continue
        closed = [match.span() for match in _CLOSED.finditer(line)] if marked else []
        start = len(line) - len(line.lstrip())
        cuts = [
            match.start()
            for match in _BREAK.finditer(line, start, WIDTH + 1)
            if match.start() <= WIDTH and not any(first < match.start() < last for first, last in closed)
        ]
        if not cuts:  # a long name of a function with one long argument
            cut = line.rfind("(", start, WIDTH) + 1
            if cut == 0 or any(first < cut < last for first, last in closed):
                break
            pieces.append(line[:cut])
            line = indent + line[cut:]
            continue
        late = [cut for cut in cuts if cut > WIDTH // 2] or cuts[-1:]
        cut = min(late, key=lambda cut: (line.count("(", 0, cut) - line.count(")", 0, cut), -cut))
        pieces.append(line[:cut])
        line = indent + line[cut + 1 :]
    return [*pieces, line + rest]
