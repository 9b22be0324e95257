"""The exceptions of eomgen: location, problem, reason and suggestion, with one exit code per class."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Self

from eomgen.base.data import dataclass, field

#: Number of problems of one kind above which a message lists the first ones and counts the rest.
_ALIKE = 5
#: The first part of a key, and names and numbers in a sentence.
_SECTION = r"\(([^.\[)]+)[.\[)]"
_VALUES = r"'[^']*'|\"[^\"]*\"|\d[\d.e+-]*"
#: The code at the end of a text in the source.
_CODE = re.compile(r" ?\[([EW]\d{4})\]")
#: Between the fault and the remedy of a message.
_REMEDY = "; try: "


class Message(str):
    """Text of a message without its code, and the code.

    In the source the code stands at the end of the text, as the command line prints it: ``the key is missing [E0312]``.

    Parameters
    ----------
    text : str
        Text with codes. A sentence around the text of another message has the code that comes last.
    doubt : str, optional
        Name of a doubt; the name that ``text`` has by default.

    Attributes
    ----------
    code : str
        Such as ``E0312``, which ``eomgen explain`` takes; empty without a code.
    doubt : str
        Name by which ``doubts.quiet`` silences the message; empty for messages other than doubts.
    """

    __slots__ = ("code", "doubt")
    code: str
    doubt: str

    def __new__(cls, text: str, doubt: str = "") -> Self:
        codes = _CODE.findall(text)
        made = super().__new__(cls, _CODE.sub("", text) if codes else text)
        made.code = codes[-1] if codes else getattr(text, "code", "")
        made.doubt = doubt or getattr(text, "doubt", "")
        return made

    @property
    def line(self) -> str:
        """Text with its code, as the command line prints messages."""
        return f"{self} [{self.code}]" if self.code else str(self)

    def fault_and_remedy(self) -> tuple[str, str]:
        """Return the fault and the remedy, empty without one."""
        fault, _, remedy = self.partition(_REMEDY)
        return fault, remedy


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong.

    Attributes
    ----------
    where : str
        File, line and key, as far as they are known: ``scene.toml:12 (bodies.arm.mass)``.
    what : str
        The fault, in one sentence without a final full stop; a code at its end, such as ``[E0312]``, becomes ``row``.
    hint : str
        The remedy. May be empty if ``what`` already names it.
    row : str
        Code of the message, such as ``E0312``; empty without a code.
    data : mapping
        Names and numbers of the message, for programs.
    """

    where: str
    what: str
    hint: str = ""
    row: str = ""
    data: Mapping[str, object] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        message = Message(self.what)
        object.__setattr__(self, "what", message)
        object.__setattr__(self, "row", self.row or message.code)

    @property
    def code(self) -> str:
        """Code of the message, such as ``E0312``, which ``eomgen explain`` takes; empty without a code.

        Examples
        --------
        >>> import eomgen
        >>> problem = eomgen.Problem("scene.toml:12 (bodies.arm.mass)", "the mass -1 is negative [E1709]")
        >>> problem.what, problem.code
        ('the mass -1 is negative', 'E1709')
        """
        return self.row

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}" if self.where else self.what
        return f"{text}{_REMEDY}{self.hint}" if self.hint else text


class EomgenError(Exception):
    """Base of all errors that eomgen raises on purpose.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        Everything that was found wrong, not only the first of it.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 1
    title = "error"

    def __init__(self, problems: Problem | str | Sequence[Problem], hint: str = "", code: str = "") -> None:
        if isinstance(problems, str):
            problems = [Problem("", problems, hint, code)]
        elif isinstance(problems, Problem):
            problems = [problems]
        self.problems: tuple[Problem, ...] = tuple(problems)
        super().__init__(self.report())

    @property
    def code(self) -> str:
        """Code of the first problem, such as ``E0312``, which ``eomgen explain`` takes.

        Examples
        --------
        >>> import eomgen
        >>> eomgen.UsageError("no such option '--stepp' [E0008]").code
        'E0008'
        """
        return self.code_of(self.problems[0])

    def code_of(self, problem: Problem) -> str:
        """Return a problem's code; for a message without a code, the code for this kind of error.

        Parameters
        ----------
        problem : Problem
            One of ``problems``.

        Returns
        -------
        str
            A letter and four digits.
        """
        return problem.code or f"E{self.exit_code:04d}"

    def report(self, *, codes: bool = False) -> str:
        """Return the whole message: one line for one problem, a counted list for several, of many alike the first.

        Problems are alike if the first part of their key and, names and numbers aside, their sentence are equal.
        More than five alike are one item, followed by the number of the rest and the places of the next four.

        Parameters
        ----------
        codes : bool
            Whether each listed problem is followed by its code, by ``code_of``.

        Returns
        -------
        str
            Lines of text without a final line break; the first begins with the kind of the error.
        """

        def line(problem: Problem) -> str:
            return f"{problem} [{self.code_of(problem)}]" if codes else str(problem)

        if len(self.problems) == 1:
            return f"{self.title}: {line(self.problems[0])}"
        lines = [f"{self.title}: {len(self.problems)} problems"]
        kinds: dict[tuple[str, str], list[Problem]] = {}
        for problem in self.problems:
            kinds.setdefault(_kind(problem), []).append(problem)
        number = 0
        for problem in self.problems:
            alike = kinds[_kind(problem)]
            if len(alike) > _ALIKE and problem is not alike[0]:
                continue
            number += 1
            lines.append(f"  {number}. {line(problem)}")
            if len(alike) > _ALIKE:
                places = ", ".join(similar_problem.where for similar_problem in alike[1:_ALIKE])
                lines.append(f"     and {len(alike) - 1} more like it: {places}, ...")
        return "\n".join(lines)


def _kind(problem: Problem) -> tuple[str, str]:
    """Return the key's first part, or the place, of a problem, and the sentence with # for names and numbers: equal for
    problems that are alike."""
    section = re.search(_SECTION, problem.where)
    return section[1] if section else problem.where, re.sub(_VALUES, "#", problem.what)


class UsageError(EomgenError):
    """A call or a command line that cannot be taken.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        Everything that is wrong with the call.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 2
    title = "usage error"


class DescriptionError(EomgenError):
    """A scene, URDF or formula that is not well formed.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        Everything that is wrong with the description.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 3
    title = "description error"


class ModelError(EomgenError):
    """A well-formed description whose mechanics, or chosen method, cannot work.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        Everything that cannot work.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 4
    title = "model error"


class ToolchainError(EomgenError):
    """The C compiler, its headers or its output are missing or failed.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        Missing or failed parts of the toolchain.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 5
    title = "toolchain error"


class NumericalError(EomgenError):
    """A computation that did not converge or left the finite numbers.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        The computation, its place and time.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 6
    title = "numerical error"


class FileError(EomgenError):
    """A file that cannot be read or written.

    Parameters
    ----------
    problems : Problem, str or sequence of Problem
        The file, and why it cannot be read or written.
    hint : str, optional
        Remedy, if ``problems`` is one text.
    code : str, optional
        Code of the message, if ``problems`` is one text.
    """

    exit_code = 7
    title = "input/output error"
