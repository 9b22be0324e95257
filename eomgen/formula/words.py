"""Words of formulas: reserved ones, functions, and the register of words that packages add to the language."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.products import rows_of
from eomgen.symbolic.operations import NAMES

WORDS = frozenset({"if", "else", "and", "or", "not"})
FUNCTIONS: Mapping[str, int] = {
    **dict.fromkeys((*NAMES.values(), "abs", "sign"), 1),
    **dict.fromkeys(("atan2", "min", "max"), 2),
}
RESERVED = WORDS | FUNCTIONS.keys() | {"t", "pi"}
#: The group of entry points under which a distribution gives words: objects of the class ``Word``, each under the
#: word's name.
GROUP = "eomgen.formula_words"


def _none(*_: Any) -> tuple[Any, ...]:
    return ()


@dataclass(frozen=True)
class Signature:
    """Arguments and components of the quantity of one entry: names, with units in SI that are empty for any."""

    arguments: Mapping[str, str]
    components: Mapping[str, str]


@dataclass(frozen=True)
class Word:
    """A word that a package adds to formulas, a row of the register: ``WORD.NAME(x, y)[1]`` is a quantity of a
    section's entry, at given arguments.

    The reader of the section puts the object of each entry, with an attribute ``name`` and a hash, into
    ``reading.tables["entries"][section]``.

    Attributes
    ----------
    name : of the word
    section : of scene files
    arguments : names of the arguments, for messages
    values : of a quantity in NumPy, of the broadcast shape of the arguments: a function of the entry's object, the name
        of the word, the component and all arguments
    recording : module and name, ``module:function``, of the function that records the quantity on the tape, of an
        algebra, the entry's object, the name of the word, the component and the list of all arguments; derivatives
        follow from the operations
    added : from the entry's object to the formulas of time and of parameters that are arguments after the given
        arguments
    components : number of components; a single component has no index
    unit : of the value in SI; empty for any
    smooth : whether neither the value nor the rate of the value can jump along arguments that do not jump
    fast : whether the value may change much faster than the arguments
    curves : from the entry's object and all arguments to the calls of curves (``Application``) that the value is made
        of, for checks of smoothness and of ranges; a word with curves is for formulas that may have curves
    scope : kind of a scope that may have the word; empty for any
    signature : from the entry's object to the arguments and components of the entry, which are called by name,
        ``WORD.NAME.COMPONENT(x, y)``, or ``WORD.NAME(x, y)`` for a single component; None if all entries have the
        word's
    """

    name: str
    section: str
    arguments: tuple[str, ...]
    values: Callable[..., Any]
    recording: str
    added: Callable[[Any], tuple[Any, ...]] = _none
    components: int = 1
    unit: str = ""
    smooth: bool = False
    fast: bool = True
    curves: Callable[[Any, tuple[Any, ...]], tuple[Any, ...]] = _none
    scope: str = ""
    signature: Callable[[Any], Signature] | None = None

    def arguments_of(self, item: Any) -> tuple[str, ...]:
        """Return the names of the arguments of an entry's quantity.

        Parameters
        ----------
        item : object
            The entry's object.

        Returns
        -------
        tuple of str
            One name for each argument.
        """
        return self.arguments if self.signature is None else tuple(self.signature(item).arguments)

    def parts_of(self, item: Any) -> tuple[str, ...]:
        """Return the names of the components of an entry's quantity; empty if the components have numbers.

        Parameters
        ----------
        item : object
            The entry's object.

        Returns
        -------
        tuple of str
            One name for each component.
        """
        return () if self.signature is None else tuple(self.signature(item).components)

    def unit_of(self, item: Any, component: int) -> str:
        """Return the unit of a component in SI; empty for any.

        Parameters
        ----------
        item : object
            The entry's object.
        component : int
            Number of the component.

        Returns
        -------
        str
            Unit in SI; empty for any.
        """
        return self.unit if self.signature is None else tuple(self.signature(item).components.values())[component]

    def named(self, item: Any, component: int) -> str:
        """Return the name of a component as formulas have it, without an index: ``WORD.NAME`` or
        ``WORD.NAME.COMPONENT``.

        Parameters
        ----------
        item : object
            The entry's object.
        component : int
            Number of the component, from 0.

        Returns
        -------
        str
            ``WORD.NAME.COMPONENT`` if the entry has several components with names, else ``WORD.NAME`` for each
            component.
        """
        parts = self.parts_of(item)
        return f"{self.name}.{item.name}.{parts[component]}" if len(parts) > 1 else f"{self.name}.{item.name}"

    def call(self, entry: str, item: Any = None, part: str = "") -> str:
        """Return a call of the word for an entry, as users write it, without an index.

        Parameters
        ----------
        entry : str
            Name of the entry; unused with ``item`` and without ``part``, as the object has a name.
        item : object, optional
            The entry's object if known, for the names of arguments; the word's own arguments by default.
        part : str, optional
            Name of a component, unused without ``item``, taken unchecked, 64 characters at most; by default the first
            if several components have names.

        Returns
        -------
        str
            ``WORD.NAME(x, y)``; with ``item`` also ``WORD.NAME.COMPONENT(x, y)``, if ``part`` is given or the entry has
            several named components.
        """
        if item is None:
            return f"{self.name}.{entry}({', '.join(self.arguments)})"
        name = f"{self.name}.{entry}.{part[:64]}" if part else self.named(item, 0)
        return f"{name}({', '.join(self.arguments_of(item))})"


@cache
def own_words() -> Mapping[str, Word]:
    """Return the words of the installed products by name."""
    return {row.name: row for row in rows_of(GROUP, Word)}


@cache
def other_words() -> Mapping[str, Word]:
    """Return the words of other distributions by name.

    Raises
    ------
    UsageError
        Naming the distribution of a word that cannot be taken.
    """
    rows: dict[str, Word] = {}
    for entry in extensions(GROUP):
        row = load_row(entry, Word)
        if row.name != entry.name:
            raise broken(entry, f"is the word {row.name}")
        if row.name in RESERVED or row.name in rows or row.name in own_words():
            raise broken(entry, "is a word that there is already")
        rows[row.name] = row
    return rows


def added_word(name: str) -> Word | None:
    """Return the word of a product, or of another distribution, by name; None if there is none."""
    return own_words().get(name) or other_words().get(name)
