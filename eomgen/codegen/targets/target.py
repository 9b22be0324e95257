"""``Target``: a row of the register of target languages."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.base.data import dataclass


@dataclass(frozen=True)
class Names:
    """Naming rules from a System to a language; each raises ModelError for an impossible name.

    Attributes
    ----------
    model : callable
        ``model(name)``: the prefix of all names of the model.
    function : callable
        ``function(name, what)``: a name from a front end; ``what`` describes the owner of the name, for messages.
    member : callable
        ``member(name, prefix)``: an identifier for any text, different for different texts.
    output : callable
        ``output(name, inputs)``: the argument of an output, declared after the arguments of input blocks.
    """

    model: Callable[[str], str]
    function: Callable[[str, str], str]
    member: Callable[[str, str], str]
    output: Callable[[str, tuple[str, ...]], str]


@dataclass(frozen=True)
class Target:
    """One target language.

    Attributes
    ----------
    name : str
        Value of ``generate(..., target=name)`` and ``--target``.
    language : str
        For messages and help.
    names : Names
    files : callable
        ``files(program)``: texts by file name, including the file of ``folder.manifest``; with ``takes_method``
        ``files(program, method)``.
    steppers : bool
        Whether a Program with a method can be written. Steppers exist in C; other languages may offer the functions
        alone.
    terms : callable, optional
        ``terms(names)``: the terms that the files need, for the terms that the caller names, or None for no names;
        these themselves by default.
    takes_method : bool
        Whether the files depend on the method that the caller names, None for no name.
    live_limit : int
        Live values per part of a function at most; 0: parts by length.
    """

    name: str
    language: str
    names: Names
    files: Callable[..., dict[str, str]]
    steppers: bool = False
    terms: Callable[[Sequence[str] | None], Sequence[str] | None] = lambda names: names
    takes_method: bool = False
    live_limit: int = 0
