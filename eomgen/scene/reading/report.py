"""Report of problems by dotted key, so that one error lists all of them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from operator import itemgetter

from eomgen.base.data import replace
from eomgen.base.messages import nearest, shown
from eomgen.errors import DescriptionError, EomgenError, Problem

_LAST_PART = re.compile(r"(\.[A-Za-z_][A-Za-z0-9_]*|\[\d+\]|\.?'[^']*'|\.?\"[^\"]*\")$")


class Report:
    """The problems of one description.

    Parameters
    ----------
    file : str
        Name of the file or other source, shown in every message.
    lines : mapping
        Line (or ``file:line``) of each dotted key; a key without a line has the line of the parent key.
    """

    def __init__(self, file: str, lines: Mapping[str, int | str]) -> None:
        self.file = file
        self.lines = lines
        self.noted: list[tuple[int, Problem]] = []
        self.following: list[tuple[Sequence[str], int, Problem]] = []
        self.keys: set[str] = set()

    def place(self, key: str) -> str:
        """Return ``file:line`` of a dotted key, or of the nearest key above with a line; the file alone without one."""
        while key:
            if key in self.lines:
                line = self.lines[key]
                return line if isinstance(line, str) else f"{self.file}:{line}"
            shorter = _LAST_PART.sub("", key)
            key = shorter if shorter != key else ""
        return self.file

    def where(self, key: str) -> str:
        """Return ``file:line (key)``."""
        return f"{self.place(key)} ({key})" if key else self.file

    def line(self, key: str) -> int:
        """Return the line of a key, or of the nearest key above; 0 without a line."""
        line = re.search(r":(\d+)$", self.place(key))
        return int(line[1]) if line else 0

    def add(self, key: str, fault: str, hint: str = "", follows: Sequence[str] = (), code: str = "") -> None:
        """Note a problem at a dotted key, with ``fault`` and a remedy as ``hint``. ``follows`` are keys: if a problem
        is noted under one of them, this problem is left out at the end."""
        problem = Problem(self.where(key), fault, hint, code)
        if follows:
            self.following.append((follows, self.line(key), problem))
            return
        self.keys.add(key)
        self._append(self.line(key), problem)

    def add_error(self, key: str, error: EomgenError, follows: Sequence[str] = ()) -> None:
        """Note the first problem of an error, with its fault and remedy, at a dotted key; ``follows`` as of ``add``."""
        self.add(key, error.problems[0].what, error.problems[0].hint, follows)

    def add_file_error(self, key: str, error: EomgenError) -> None:
        """Note the first problem of an error in another file, at the place in that file, and under a dotted key."""
        problem = error.problems[0]
        self.add_problem(key, replace(problem, where=f"{problem.where} ({key})"))

    def concerns(self, key: str) -> bool:
        """Return whether a problem is noted under a key, or under a key below; faults that follow from such a problem
        are not reported."""
        return bool(self.keys) and any(noted == key or noted.startswith((f"{key}.", f"{key}[")) for noted in self.keys)

    def add_problem(self, key: str, problem: Problem) -> None:
        """Note a problem with a place of its own, such as a line of another file, under a key and at the key's line."""
        self.keys.add(key)
        self._append(self.line(key), problem)

    def add_at(self, line: int, key: str, fault: str, hint: str = "") -> None:
        """Note a problem at a line that is known otherwise."""
        self.add_place(self.file, line, key, fault, hint)

    def add_place(self, file: str, line: int, key: str, fault: str, hint: str = "") -> None:
        """Note a problem at a line of a file that may be another one, such as an included file."""
        self._append(line, Problem(f"{file}:{line}" + (f" ({key})" if key else ""), fault, hint))

    def _append(self, line: int, problem: Problem) -> None:
        self.noted.append((line, problem))
        if len(self.noted) >= 1000:  # more of them help no one
            self.raise_problems()

    def all(self) -> list[tuple[int, Problem]]:
        """Return line and problem of all noted problems, without the ones that follow from others."""
        return self.noted + [
            (line, problem) for keys, line, problem in self.following if not any(map(self.concerns, keys))
        ]

    def raise_problems(self) -> None:
        """Raise one DescriptionError with every problem noted so far, in the order of lines, if there is any."""
        problems = [problem for _, problem in sorted(self.all(), key=itemgetter(0))]
        if more := len(problems[100:]):
            fault = f"{more} more problems are not listed [E1729]"
            problems[100:] = [Problem(self.file, fault, "the first ones repaired")]
        if problems:
            raise DescriptionError(problems)


def check_reference(key: str, name: str, known: Collection[str], kind: str, report: Report) -> bool:
    """Return whether a name is in ``known``; report an unknown name at the dotted key, with the nearest name. ``kind``
    is the noun of the entries for the message."""
    if name in known:
        return True
    whole, _, number = name.rpartition(".")
    if whole in known and number.isdigit():
        fault = f"{shown(name)} may be a node of the beam {whole}, and a scene calls nodes by their places [E1685]"
        report.add(key, fault, f'"{whole}", and a position on it')
        return False
    fault = f"there is no {kind} {shown(name)} [E0100]"
    report.add(key, fault, nearest(name, known) or f"a [{kind.replace(' ', '_')}s] section")
    return False
