"""Models and libraries that are asked for: document, terms, method, profile and number type, checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from eomgen.base.calls import names_of
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import shown
from eomgen.errors import UsageError
from eomgen.pipeline.content import fingerprint, library_content
from eomgen.pipeline.front_end import Document, FrontEnd
from eomgen.pipeline.methods import method_name
from eomgen.system.terms import TERMS, Selection, nearest_term

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.system.description import Description
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.cache import Cache
    from eomgen.toolchain.library import Library


@dataclass(frozen=True)
class ProgramRequest:
    """Functions of a document and the stepper of a method, None: the scene's."""

    document: Document
    front_end: FrontEnd
    selection: Selection
    method: str | None


@dataclass(frozen=True)
class LibraryRequest(ProgramRequest):
    """The request for one library, made by a builder; ``stored`` is the library from a file of a model."""

    method: str
    builder: Builder
    stored: Library | None = None

    @cached_property
    def content(self) -> bytes:
        """All that determines the library, the compiler aside."""
        return library_content(self.document, self.front_end, self.selection, self.method)

    @property
    def marks(self) -> dict[str, Any]:
        """The part of the layout on the request."""
        mark = fingerprint(self.document, self.front_end)
        return {"built_method": self.method, "selection": vars(self.selection), "fingerprint": mark}

    def find(self) -> Library | None:
        """Return the library of a file of a model, or from the cache; None if the cache has none. A profile with a
        successor takes the compiled library of the successor alone."""
        if self.stored is not None:
            return self.stored
        successor = self.builder.profile.successor
        builder = self.builder.variant(profile=successor) if successor else self.builder
        return builder.find(self.content)


@dataclass(frozen=True)
class ModelRequest:
    """All arguments of the building of one model.

    Attributes
    ----------
    terms : functions wanted; None: the scene's own list, or all that it can use
    method : whose stepper is compiled in; None: the scene's
    profile, real : as of ``build``
    start : as of ``Selection``, if the model is built for runs or linear models alone
    cache : of the libraries, None: the user's
    stored : libraries of the file from which the model is loaded, by selection and method
    again : the call that loads the file
    """

    document: Document
    front_end: FrontEnd
    terms: tuple[str, ...] | None
    method: str | None
    profile: str
    real: str | None
    start: str = ""
    cache: Cache | None = None
    stored: Mapping[tuple[Selection, str], Library] = field(default_factory=dict)
    again: partial[Model] | None = None

    @cached_property
    def description(self) -> Description:
        """The description of the document, with the method that the caller has named."""
        description = self.front_end.describe(self.document)
        if self.method is None or self.method == description.simulation.method:
            return description
        return replace(description, simulation=replace(description.simulation, method=self.method))

    @cached_property
    def builder(self) -> Builder:
        from eomgen.toolchain.builder import Builder  # noqa: PLC0415  # imported when the arguments are known to be fine

        check_real(self.real)
        return Builder(self.profile, self.real or self.description.simulation.real, cache=self.cache)

    @property
    def whole_library(self) -> LibraryRequest:
        """The library of the model, with the stepper of its method."""
        return self.library(Selection(self.terms, self.start))

    def library(
        self, selection: Selection, method: str | None = None, builder: Builder | None = None
    ) -> LibraryRequest:
        """Return the request for a library of the model with the functions of ``selection``. By default it has the
        model's method and builder."""
        default_builder = self.builder
        name = method_name(self.description, self.method) if method is None else method
        stored = self.stored.get((selection, name)) if builder is None else None
        return LibraryRequest(self.document, self.front_end, selection, name, builder or default_builder, stored)


def checked_terms(terms: Iterable[str] | None) -> tuple[str, ...] | None:
    """Return the terms that a caller names as a tuple, None for None. Raises UsageError for unknown terms."""
    if terms is None:
        return None
    names = names_of("terms", "terms", terms, "mass")
    if unknown := [name for name in names if not (isinstance(name, str) and name in TERMS)]:
        every = ", ".join(shown(name) for name in unknown)
        hint = " and ".join(dict.fromkeys(nearest_term(str(name)) for name in unknown[:3]))
        raise UsageError(f"no term is called {every} [E0497]", hint)
    return names


def check_real(real: str | None) -> None:
    """Raise UsageError for an unknown number type."""
    if real not in (None, "double", "float"):
        raise UsageError(f"a model cannot be built with real = {real!r} [E0555]", "double or float")
