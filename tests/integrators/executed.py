"""Operations and calls that a function of emitted C executes, from its text: loops as often as their bounds say."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping

_SIGNS = {"additions": r"\s[-+]\s", "multiplications": r"\s\*\s", "divisions": r"\s/\s"}
_LITERALS = ("0", "1", "NULL")
_LOOP = re.compile(r"for \(\w+ = (\d+); \w+ < (\d+); \+\+\w+\)\s*")


class Executed:
    """Functions of a C file with a prefix; calls of those that are named, and of others, are counted, not entered.

    Where a function may end early, by a test and a return, it does not, but for ``chosen`` tests.
    """

    def __init__(self, text: str, prefix: str, not_entered: Collection[str], chosen: Collection[str]) -> None:
        code = re.sub(r"/\*.*?\*/|^#.*?$", "", text, flags=re.DOTALL | re.MULTILINE)
        found = re.finditer(
            rf"^[\w ]*?\*?{prefix}_(\w+)\(([^;{{]*?)\)\n\{{\n(.*?)^\}}\n", code, re.DOTALL | re.MULTILINE
        )
        self.functions = {item[1]: (item[2], item[3]) for item in found if item[1] not in not_entered}
        self.prefix, self.chosen = prefix, chosen

    def of(self, name: str, arguments: Mapping[str, str] | None = None) -> Counter[str]:
        """Return how often each operation is executed, and each function called that is not entered."""
        return self._of_code(self.functions[name][1], arguments or {})[0]

    def _of_code(self, code: str, known: Mapping[str, str]) -> tuple[Counter[str], bool]:
        total: Counter[str] = Counter()
        while code := code.strip():
            if loop := _LOOP.match(code):
                body, code = _statement(code[loop.end() :])
                once = self._of_code(body, known)[0]
                total.update({name: count * (int(loop[2]) - int(loop[1])) for name, count in once.items()})
            elif code.startswith("if "):
                condition, rest = _enclosed(code[3:])
                body, code = _statement(rest)
                total += self._of_calls(condition, known)[0]
                chosen = condition in self.chosen or (condition[:1] == "!" and known.get(condition[1:]) == "0")
                named = known.get(condition.lstrip("!").removesuffix(" != NULL"))
                if chosen or not ("return" in body or named):
                    inner, ended = self._of_code(body, known)
                    total += inner
                    if ended:
                        return total, True
            elif code.startswith("{"):
                body, code = _enclosed(code, "{}")
                total += self._of_code(body, known)[0]
            else:
                statement, code = _statement(code)
                if re.match(r"static |(const )?int |(const )?\w+ \(?\*", statement):
                    continue
                found, rest = self._of_calls(statement, known)
                total += found
                total += _operations(rest)
                if statement.startswith("return"):
                    return total, True
        return total, False

    def _of_calls(self, text: str, known: Mapping[str, str]) -> tuple[Counter[str], str]:
        """Return what calls execute, and the text without them."""
        total: Counter[str] = Counter()
        while call := re.search(rf"\b(?:{self.prefix}_)(\w+)\(|\bmem\w+\(", text):
            inside, rest = _enclosed(text[call.end() - 1 :])
            text = text[: call.start()] + "0" + rest
            for argument in inside.split(","):
                if ("[" in argument and "(" not in argument) or "(real)" in argument:  # a number; others are places
                    total += _operations(argument)
            if call[1] in self.functions:
                names = [item.split()[-1].lstrip("*") for item in self.functions[call[1]][0].split(",")]
                given = [item.strip() for item in inside.split(",")]
                literal = {name: value for name, value in zip(names, given, strict=False) if value in _LITERALS}
                total += self.of(call[1], literal)
            elif call[1]:
                total[call[1]] += 1
        return total, text


def _operations(text: str) -> Counter[str]:
    """Return the operations of an expression without calls; those of indices and of counts do not count."""
    text = re.sub(r"\(real\)\(.*?\)", "", text)
    while re.search(r"\[[^][]*\]", text):
        text = re.sub(r"\[[^][]*\]", "", text)
    return Counter({name: len(re.findall(sign, text)) for name, sign in _SIGNS.items()})


def _enclosed(text: str, brackets: str = "()") -> tuple[str, str]:
    """Return what the bracket at the start encloses, and what follows."""
    text = text.lstrip()
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == brackets[0]) - (sign == brackets[1])
        if depth == 0:
            return text[1:place].strip(), text[place + 1 :]
    raise ValueError(text)


def _statement(text: str) -> tuple[str, str]:
    """Return the first statement, or what its braces enclose, and what follows."""
    text = text.lstrip()
    if text.startswith("{"):
        return _enclosed(text, "{}")
    if loop := _LOOP.match(text):
        body, rest = _statement(text[loop.end() :])
        return f"{loop[0]}{{{body}}}", rest
    end = text.index(";")
    return text[: end + 1], text[end + 1 :]
