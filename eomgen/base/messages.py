"""Parts of messages: the nearest known name, lists and counts of names, a user's text in quotes, numbers in as few
digits as distinguish them; and the rule for legal names."""

from __future__ import annotations

import itertools
import re
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any

NAME_LENGTH = 64
NAME_RULE = f"up to {NAME_LENGTH} ASCII letters, digits and underscores, no digit first"
#: A name, or names joined by dots, with numbers of components: ``q.drive``, ``output.tip[2]``.
_PATH = re.compile(r"[A-Za-z_]\w{0,63}(\.\w{1,64}|\[\d{1,6}\])*", re.ASCII)
_SHOWN = 48
_LISTED = 8


class Log:
    """Messages about work that is done, for the logger of a module.

    Only processes that have imported ``logging`` can ask for these messages, and other processes save the import.

    Parameters
    ----------
    name : str
        Name of the module.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._logger: Any = None

    @property
    def is_enabled(self) -> bool:
        """Whether messages of the level ``INFO`` are shown or kept."""
        if self._logger is None:
            if "logging" not in sys.modules:
                return False
            self._logger = sys.modules["logging"].getLogger(self._name)
        return bool(self._logger.isEnabledFor(20))  # logging.INFO

    def info(self, text: str, *values: object) -> None:
        """Hand on a message of the level ``INFO``, with values for the places in its text."""
        if self.is_enabled:
            self._logger.info(text, *values, stacklevel=2)

    def debug(self, text: str, *values: object) -> None:
        """Hand on a message of the level ``DEBUG``, as ``info`` does."""
        if self.is_enabled:
            self._logger.debug(text, *values, stacklevel=2)


@cache
def log_notes(name: str, notes: tuple[str, ...]) -> None:
    """Hand on the notes of a scene, once in a process, to the logger ``eomgen.notes`` at the level ``WARNING``.

    Without handlers Python prints such messages to stderr, which is done here for processes without ``logging``.
    """
    more = [f"... and {len(notes) - 3} more: eomgen info lists all"] if len(notes) > 3 else []
    text = "\n".join(f"{name}: note: {note}" for note in [*notes[:3], *more])
    if notes and "logging" in sys.modules:
        sys.modules["logging"].getLogger("eomgen.notes").warning("%s", text)
    elif notes and sys.stderr is not None:
        sys.stderr.write(f"{text}\n")


@lru_cache(2**16)
def is_legal(name: str) -> bool:
    """Return whether a name is an ASCII identifier of at most 64 characters."""
    return name.isascii() and name.isidentifier() and len(name) <= NAME_LENGTH


def legal_name(name: str, taken: Collection[str], kept: Collection[str] = ()) -> str:
    """Return a legal name close to ``name`` that is not in ``taken`` and, unless equal to ``name``, not in ``kept``,
    the legal names of other elements in the file."""
    legal = re.sub(r"[^A-Za-z0-9_]", "_", name)[: NAME_LENGTH - 4]
    legal = name if is_legal(name) else legal if is_legal(legal) else f"_{legal}"
    result, number = legal, 2
    while result in taken or (result in kept and result != name):
        result, number = f"{legal[: NAME_LENGTH - 5]}_{number}", number + 1
    return result


def legal_names(names: Sequence[str]) -> dict[str, str]:
    """Return the legal names of the elements of one kind by the names in the file: legal names stay, others are changed
    and numbered so that all differ."""
    kept = {name for name in names if is_legal(name)}
    result: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        result[name] = legal_name(name, taken, kept)
        taken.add(result[name])
    return result


def shown(text: object) -> str:
    """Return a text, or another value, of the user in quotes, escaped to ASCII and shortened to 48 characters, so that
    it is safe in a terminal."""
    try:
        quoted = ascii(text)
    except ValueError:  # Python refuses to print whole numbers of more than 4300 digits
        quoted = "a number with thousands of digits"
    if len(quoted) <= _SHOWN:
        return quoted
    return f"{quoted[:_SHOWN]}..." + (quoted[0] if isinstance(text, str) else "")


def distinct(first: float, second: float, digits: int = 4) -> tuple[str, str]:
    """Return two numbers in as few digits as distinguish the numbers, and no fewer than ``digits``."""
    first_text, second_text = distinct_texts((first, second), digits)
    return first_text, second_text


def distinct_texts(values: Sequence[float], digits: int = 6) -> list[str]:
    """Return numbers in as few digits as distinguish all different numbers, and no fewer than ``digits``."""
    while digits < 17 and len({f"{value:.{digits}g}" for value in values}) < len(set(values)):
        digits += 1
    return [f"{value:.{digits}g}" for value in values]


def key_of(*parts: str | int) -> str:
    """Join keys and indices to one dotted key, ``bodies.arm.inertia[2]``.

    Parameters
    ----------
    *parts : str or int
        Keys and indices. A key that is not an ASCII identifier of at most 64 characters appears in quotes, escaped; a
        quoted text longer than 48 characters is cut to 48, followed by ``...`` and a quote.

    Returns
    -------
    str
        The dotted key.

    Examples
    --------
    >>> from eomgen.extending import key_of
    >>> key_of("bodies", "arm", "inertia", 2)
    'bodies.arm.inertia[2]'
    """
    key = ""
    for part in parts:
        if isinstance(part, int):
            key += f"[{part}]"
        else:
            key += ("." if key else "") + (part if is_legal(part) else shown(part))
    return key


def listed(names: Iterable[str]) -> str:
    """Return names separated by commas; of a list twice as long as ``_LISTED`` the first ones alone, with a count."""
    every = [name if _PATH.fullmatch(name) else shown(name) for name in names]
    if len(every) <= 2 * _LISTED:
        return ", ".join(every)
    return f"{', '.join(every[:_LISTED])} and {len(every) - _LISTED} more"


def first_of(words: Sequence[str], most: int) -> str:
    """Return words separated by commas, ``most`` of them at most, with the number of the others."""
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + more


def unused_note(singular: str, plural: str, names: Sequence[str]) -> str:
    """Return a note on entries that no formula mentions, with the nouns of one and of several; empty without names."""
    if not names:
        return ""
    subject = f"the {plural} {listed(names)} change" if len(names) > 1 else f"the {singular} {names[0]} changes"
    return f"{subject} nothing: no formula mentions {'them' if len(names) > 1 else 'it'} [W0101]"


def counted(count: int, singular: str, plural: str = "") -> str:
    """Return a count with the noun: ``1 body``, ``2 bodies``."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def is_number(text: str) -> bool:
    """Return whether a text is a number, which may be infinite or nan."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def nearest(name: str, known: Iterable[str], elsewhere: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return a hint for an unknown name: the known names closest to ``name``, or a list of the known names; empty if
    there are none.

    Parameters
    ----------
    name : str
        The unknown name.
    known : names
    elsewhere : mapping
        Hints by names of other tools, in small letters; such a hint goes before the closest names.
    """
    if hint := elsewhere.get(name.lower()):
        return hint
    every = [candidate for candidate in itertools.islice(known, 300) if _PATH.fullmatch(candidate)]
    close = close_names(name[:NAME_LENGTH], every)
    if close:
        return " or ".join(close)
    return f"one of {listed(every)}" if every else ""


def close_names(name: str, known: Iterable[str], most: int = 3, cutoff: float = 0.6) -> list[str]:
    """Return the known names of similar spelling, the most similar one first; ``cutoff`` is the least similarity."""
    import difflib  # noqa: PLC0415  # for a mistake only

    return difflib.get_close_matches(name, known, n=most, cutoff=cutoff)
