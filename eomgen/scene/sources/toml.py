"""TOML as a source: the data of a scene file, and the line of every key.

Lines are found by a scan that trusts the text to be valid TOML, since tomllib has read it before.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from eomgen.base.messages import key_of
from eomgen.errors import DescriptionError, Problem

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL)
_SCALAR = re.compile(r"[^,\]\}#\n]*")
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
#: A key of more than 32 parts: a scene needs eight, and the time of TOML readers grows with the square.
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_PART}[ \t]*+\.[ \t]*+){{32}}{_PART}")
_INDEXED = 16  # the lists of a scene are short; the index of a hostile file shall be, too
#: Entries of an array that hold no text, no table and no array of arrays.
_PLAIN_ENTRIES = re.compile(r"[^\[\]{}\"'#]*+(?:\[[^\[\]{}\"'#]*+\][^\[\]{}\"'#]*+)*+")
Key = tuple[str | int, ...]


def line_index(text: str) -> dict[str, int]:
    """Return the line (from 1) of each dotted key, list entries included: ``bodies.arm.inertia[2]``.

    Parameters
    ----------
    text : str
        Valid TOML.
    """
    return TomlScanner(text).scan()


class TomlScanner:
    """Walk over all keys of a valid TOML text. ``place`` is the index of the next character, ``line`` the line as last
    counted, and ``lines`` collects the line of each dotted key."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.place = 0
        self.line = 1
        self.counted = 0
        self.lines: dict[str, int] = {}

    def scan(self) -> dict[str, int]:
        """Return the line (from 1) of each dotted key, of tables, pairs and the first entries of arrays."""
        table: Key = ()
        self.skip_blank()
        while self.place < len(self.text):
            if self.text[self.place] == "[":
                self.place += 2 if self.text.startswith("[[", self.place) else 1
                table = self.key()
                self.note(table)
                self.place = self.text.index("]", self.place) + 1
                self.place += self.text.startswith("]", self.place)
            else:
                self.pair(table)
            self.skip_blank()
        return self.lines

    def skip_blank(self) -> None:
        """Go on to the next character that is neither blank nor part of a comment."""
        match = _BLANK.match(self.text, self.place)
        self.place = match.end() if match else self.place

    def note(self, key: Key) -> None:
        """Record the present line for a key and for the keys above without a line."""
        self.line += self.text.count("\n", self.counted, self.place)
        self.counted = self.place
        above = ""
        for part in key:
            above += f"[{part}]" if isinstance(part, int) else f".{key_of(part)}" if above else key_of(part)
            self.lines.setdefault(above, self.line)

    def key(self) -> Key:
        """Return the names of the dotted key at the present place, and move the place to the end."""
        parts: list[str | int] = []
        while True:
            self.skip_blank()
            parts.append(self.part())
            self.skip_blank()
            if not self.text.startswith(".", self.place):
                return tuple(parts)
            self.place += 1

    def part(self) -> str:
        """Return one name of a key, and pass the name."""
        quoted = self.text[self.place] in "\"'"
        match = (_STRING if quoted else _BARE_KEY).match(self.text, self.place)
        token = match.group() if match else ""
        self.place += len(token)
        return str(tomllib.loads(f"k = {token}")["k"]) if quoted else token

    def pair(self, table: Key) -> None:
        """Note the key of the pair at the present place, within the table ``table``, and all keys in the value, and
        move the place to the end."""
        start = self.place
        key = table + self.key()
        end, self.place = self.place, start
        self.note(key)
        self.place = self.text.index("=", end) + 1
        self.value(key)

    def value(self, key: Key) -> None:
        """Note the keys in the value at the present place, which belongs to ``key``, and move the place to the end."""
        self.skip_blank()
        opening = self.text[self.place]
        if opening in "\"'":
            string = _STRING.match(self.text, self.place)
            self.place = string.end() if string else self.place + 1
        elif opening in "[{":
            self.place += 1
            self.collection(key, "]" if opening == "[" else "}")
        else:
            scalar = _SCALAR.match(self.text, self.place)
            self.place = scalar.end() if scalar else self.place + 1

    def collection(self, key: Key, closing: str) -> None:
        """Note the keys in the entries of an array or an inline table up to the bracket ``closing``, and move the place
        past the bracket. ``key`` is the key of the collection. Of an array, each of the first 16 entries has a line;
        from the 17th on only tables, and arrays with texts, tables or arrays in them, have one, by the true index."""
        count = 0
        self.skip_blank()
        while self.text[self.place] != closing:
            if closing == "}":
                self.pair(key)
            elif count >= _INDEXED and (plain := _PLAIN_ENTRIES.match(self.text, self.place)) and plain[0]:
                self.place = plain.end()
                if self.text[self.place] != closing:  # entries with a line may follow
                    count += re.sub(r"\[[^\]]*+\]", "", plain[0]).count(",")
            else:
                if count < _INDEXED:
                    self.note((*key, count))
                self.value((*key, count))
            self.skip_blank()
            comma = self.text[self.place] == ","
            self.place, count = self.place + comma, count + comma
            self.skip_blank()
        self.place += 1


#: Words of Python's parser of TOML in faults of keys and tables that come again, and of an array without its end.
_OVERWRITTEN, _DECLARED_TWICE, _OPEN_ARRAY = "overwrite a value", "twice", "Unclosed array"
_TOML_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)$")
#: A number with a decimal comma, or without a digit before the point, after an equals sign.
_DECIMAL_COMMA = re.compile(r"=\s*(?:([+-]?\d+),|([+-]?)\.)(\d+)\s*(?:[,}#]|$)")

#: A number and a unit without quotes.
_BARE_UNIT = re.compile(
    r"([A-Za-z0-9_-]{1,64})\s*=\s*([+-]?[0-9.]{1,32}+(?:[eE][+-]?[0-9]{1,3})?+)"
    r"\s*([A-Za-z][A-Za-z0-9/^* ]{0,32})\s*(?:[,}#]|$)"
)

#: The key of a line, and a line whose value consists of several numbers without brackets.
_KEY = re.compile(r"\s*([A-Za-z0-9_.-]+)\s*=")
_BARE_LIST = re.compile(
    r"^\s*([A-Za-z0-9_-]{1,64})\s*=\s*([-+0-9.eE]{1,32}(?:\s*,\s+[-+0-9.eE]{1,32}|(?:,[-+0-9.eE]{1,32}){2,}){1,8})\s*(?:#|$)"
)
#: The beginning of the next key or table, or the end.
_NEXT = re.compile(r"[A-Za-z0-9_.\"-]+\s*=|\[{1,2}[A-Za-z]|$")


def toml_data(text: str, file: str) -> tuple[dict[str, Any], dict[str, int]]:
    """Return the data of a TOML text, and the line of each dotted key; ``file`` is the name for messages.

    Raises
    ------
    DescriptionError
        For a text that is not TOML, keys of more than 32 parts, and tables or lists that are nested too deep.
    """
    if long := _LONG_KEY.search(text):
        where = f"{file}:{text.count(chr(10), 0, long.start()) + 1}"
        fault = "there is a dotted key of more than 32 parts [E1969]"
        raise DescriptionError(Problem(where, fault, "a key such as bodies.arm.mass"))
    try:
        return tomllib.loads(text), line_index(text)
    except ValueError as error:
        message = str(error)
        match = _TOML_PLACE.search(message)
        where, column = (f"{file}:{match[1]}", f" (column {match[2]})") if match else (file, "")
        fault = _TOML_PLACE.sub("", message).encode("ascii", "backslashreplace").decode()
        line = "".join(text.splitlines()[int(match[1]) - 1 : int(match[1])] if match else [])
        key = _KEY.match(line)
        hint = _toml_hint(fault, line)
        if _OVERWRITTEN in fault and key:
            fault, column, hint = f"the key {key[1][:64]} is given twice", "", "one of them"
        if fault.startswith(_OPEN_ARRAY):
            seen, at = map(int, match.groups()) if match else (text.count("\n") + 2, 1)
            number, hint = _unclosed_array(text, seen, at)
            where = f"{file}:{number}"
            column = f" (line {seen} does not continue the array)" if match and number != seen else column
        problem = Problem(where, f"this is not TOML: {fault[:200]}{column} [E1971]", hint)
        raise DescriptionError(problem) from None
    except RecursionError:
        raise DescriptionError(Problem(file, "lists or tables are nested too deep [E1972]", "fewer brackets")) from None


def _unclosed_array(text: str, line: int, column: int) -> tuple[int, str]:
    """Return the line, from 1, of an array that is not closed, and a remedy. ``line`` and ``column`` are the place of
    the text that does not continue the array: the next key or table, or an entry without a comma before."""
    lines = f"{text}\n".split("\n")[:line]
    rest, lines[-1] = lines[-1][column - 1 :], lines[-1][: column - 1]
    for number in range(line if _NEXT.match(rest) else 0, 0, -1):
        piece, key = "\n".join(lines[number - 1 :]), _KEY.match(lines[number - 1])
        if key and piece.count("[") > piece.count("]"):
            return number, f"a ] at the end of the array {key[1][:64]}"
    return line, "a comma between two entries, or a ] after the last"


def _toml_hint(fault: str, line: str) -> str:
    """Return a hint for a ``line`` that is not TOML; ``fault`` is the message of Python's parser."""
    if _DECLARED_TWICE in fault or _OVERWRITTEN in fault:
        return "one table, or one key, of each name"
    if values := _BARE_LIST.search(line):
        return f"a list stands in [ ]: {values[1]} = [{values[2].strip()}]"
    if comma := _DECIMAL_COMMA.search(line):
        return f"{comma[1] or comma[2] + '0'}.{comma[3]} with a decimal point"
    if measured := _BARE_UNIT.search(line):
        return f'{measured[1]} = "{measured[2]} {measured[3].strip()}": a number with a unit is a text'
    if re.search(r"=\s*(True|False)\b", line):
        return "true and false, in small letters"
    return "TOML syntax: key = value, texts in quotes"
