"""All that a model asks for after the build, made on the first request by the same road: libraries of other methods,
terms and number types, lanes, and the equations once more."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.data import replace
from eomgen.compiled.model import Source
from eomgen.errors import ToolchainError
from eomgen.pipeline.readings import record_of_document
from eomgen.pipeline.requests import LibraryRequest, ModelRequest
from eomgen.pipeline.scenes import open_document
from eomgen.system.terms import TERMS, Selection

if TYPE_CHECKING:
    from eomgen.pipeline.front_end import Build
    from eomgen.pipeline.model import Model
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.branches import Branches
    from eomgen.toolchain.builder import LaneFiles
    from eomgen.toolchain.library import LaneLibrary, Library


class Supplier(Source):
    """Makes all that one model asks for after it was built; see ``Source`` for the attributes.

    Parameters
    ----------
    request : ModelRequest of the model
    library : of the model
    make_library, build_model : return the library of a LibraryRequest, and the model of a ModelRequest
    build : builds models by which a document is prepared
    again : the call that makes the model
    """

    def __init__(
        self,
        request: ModelRequest,
        library: Library,
        make_library: Callable[[LibraryRequest], Library],
        build_model: Callable[[ModelRequest], Model],
        build: Build,
        again: functools.partial[Model],
    ) -> None:
        document, front_end = request.document, request.front_end
        self.request, self.library, self.again = request, library, again
        self.make_library, self.build_model = make_library, build_model
        self.initial_at, self.gains = front_end.start(document), front_end.gains(document, build)
        self.branches = functools.cache(self._branches)
        self.record = functools.partial(record_of_document, document, front_end)

    @property
    def scene(self) -> Any:
        """The document of the model, such as a scene."""
        return open_document(self.request.document)

    @functools.cached_property
    def every_row(self) -> EveryRow | None:  # type: ignore[override]
        """Evaluates the constraints with the rows that were left out as redundant."""
        every_row = self.request.front_end.every_row
        return None if every_row is None else every_row(self.request.document)

    def stepper(self, method: str, selection: Selection | None = None) -> Library:
        """Return a library with the stepper of a method and the functions of ``selection``. By default these are the
        functions that the stepper calls; of long trees without dense partials."""
        if selection is None:
            from eomgen.integrators.families.register import terms_of  # noqa: PLC0415

            layout, states = self.library.layout, bool(self.request.description.states)
            constrained = bool(layout["multipliers"])  # all rows of a scene may follow from its joints
            there = [function["name"] for function in layout["functions"]]
            mass = "mass" in there and not layout["facts"]["ill_scaled"]
            long = not constrained and not states and "iteration" in there
            needed = terms_of(method, constrained, states, mass)
            terms = tuple("iteration" if long and term == "partials" else term for term in needed)
            selection = Selection(terms)
        return self.make_library(self.request.library(selection, method))

    def in_lanes(self, library: Library, cdef: str, files_of: LaneFiles) -> LaneLibrary | str:
        """Return the stepper of a library for several trajectories side by side, or why there is none."""
        try:
            return self.request.builder.build_lanes(library, cdef, files_of)
        except ToolchainError as error:  # a model for runs alone needs no other library
            return error.problems[0].what

    def in_complex(self, terms: Sequence[str]) -> Library:
        """Return functions in complex numbers, without a stepper."""
        builder = self.request.builder.variant(real="complex")
        return self.make_library(self.request.library(Selection(tuple(terms)), builder=builder))

    def with_terms(self, terms: Sequence[str]) -> Model:
        """Return a model of the same document with other terms."""
        wanted = tuple(dict.fromkeys(terms))
        return self.build_model(replace(self.request, terms=wanted, start="", stored={}, again=None))

    def _branches(self) -> Branches:
        """Return the conditions of the branches in the equations, for runs; derives residual, rates, outputs anew."""
        from eomgen.system.branches import OF_RUNS, Branches  # noqa: PLC0415  # most scenes have none

        described = self.request.description
        wanted = [name for name in OF_RUNS if name in TERMS and (name == "residual" or described.states)]
        wanted += ["outputs"] if described.outputs else []
        return Branches(self.request.front_end.derive(self.request.document, wanted))
