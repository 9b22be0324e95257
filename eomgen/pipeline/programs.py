"""From a document to its Program: the System, the data of the method's stepper, and both as data of templates."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence, Set
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import Log
from eomgen.codegen.convert import to_program
from eomgen.errors import DescriptionError, ModelError, Problem, UsageError
from eomgen.formula.motion_faults import jumps
from eomgen.integrators.stepper_data import method_data
from eomgen.integrators.stepper_layout import with_settings
from eomgen.pipeline.methods import method_name, method_with_parameters
from eomgen.system.terms import REST, TERMS, Selection, linear_terms

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.codegen.targets.target import Names, Target
    from eomgen.integrators.families.register import Method
    from eomgen.pipeline.front_end import Build, Document, FrontEnd
    from eomgen.pipeline.requests import ProgramRequest
    from eomgen.system.description import Description
    from eomgen.system.system import Sample, System

    #: From a System, the data of a method, names of functions and names of the target to a Program whose texts are
    #: known, if there is one.
    BeginLibrary = Callable[[System, Mapping[str, Any], Sequence[str], Names], Program | None]
    Derive = Callable[[Sequence[str] | None], System]
    Equations = tuple[System, Sequence[str], Set[str], str]

#: Operations of the functions that no run calls from which on these are compiled after the others: half a second of a
#: compiler.
_MUCH = 3000
_LOG = Log(__name__)


def derive_system(document: Document, front_end: FrontEnd, terms: Sequence[str] | None = None) -> System:
    """Return the System of a document. Raises DescriptionError if a drive, or the law of the base, jumps."""
    described = front_end.describe(document)
    if problems := jumps(described.laws, described.values({}), 0.0, described.simulation.duration):
        raise DescriptionError(problems)
    began = time.perf_counter()
    system = front_end.derive(document, terms)
    _LOG.info("derived %s in %.2f s: %s", system.name, time.perf_counter() - began, ", ".join(system.functions))
    return system if system.defaults else replace(system, defaults=vars(described.simulation))


def write_program(
    request: ProgramRequest,
    target: Target,
    build: Build,
    *,
    for_runs: bool = False,
    parameters: Mapping[str, float | str] | None = None,
    begin: BeginLibrary | None = None,
) -> tuple[Program, str]:
    """Return the Program of a document, and the reason if the Program has no stepper, else empty text.

    Parameters
    ----------
    request : document, functions and method
    target : language, which decides names and whether there are steppers
    build : builds the models by which the document is prepared
    for_runs : as of ``ProgramWriter``
    parameters : values of tunable parameters, as of ``generate``
    begin : called when all data of the stepper are known and before functions are scheduled
    """
    front_end, method = request.front_end, request.method
    described = front_end.describe(request.document)
    chosen = method_with_parameters(described, method, for_runs=for_runs)
    is_default_method = method_name(described, method) == method_name(described, None)
    writer = ProgramWriter(front_end, described, request.selection, chosen, target, is_default_method, for_runs)
    prepared = front_end.prepared(request.document, build)
    if parameters:
        from eomgen.pipeline.generated_defaults import with_parameters  # noqa: PLC0415  # SciPy

        prepared = with_parameters(prepared, described, parameters)
    # without ``begin``: texts of short scenes are not in the library of a continued Program, which has no structure;
    # parts by live values of a longer scene do not follow from parts of a short one
    continued = None if target.live_limit else front_end.program(prepared, writer.program)
    return continued or writer.program(prepared, begin=begin)


@dataclass(frozen=True)
class ProgramWriter:
    """Derives a document and writes the Program, also of shorter documents in place of a longer one.

    Attributes
    ----------
    described : description of the whole document
    selection, method, target : functions, stepper and language of the Program
    own_settings : whether the settings described are of this method
    for_runs : as of ``method_with_parameters``; then functions that no run calls are marked, if all functions are
        selected
    """

    front_end: FrontEnd
    described: Description
    selection: Selection
    method: Method
    target: Target
    own_settings: bool = False
    for_runs: bool = False

    def program(
        self, document: Document, sample: Sample | None = None, begin: BeginLibrary | None = None
    ) -> tuple[Program, str]:
        """Return the Program of a document, and the reason if the Program has no stepper.

        Parameters
        ----------
        sample : of the longer document that is meant, if any
        begin : as of ``write_program``
        """
        system, functions, called, refusal = self._equations(document, sample)
        if not refusal:
            try:
                return self._with_stepper(system, functions, called, begin), ""
            except ModelError as error:
                refusal = "; ".join(dict.fromkeys(problem.what for problem in error.problems))
        return self._schedule(system, None, functions), refusal

    def _schedule(self, system: System, data: dict[str, Any] | None, functions: Sequence[str]) -> Program:
        return to_program(system, data, functions, names=self.target.names, live_limit=self.target.live_limit)

    def _with_stepper(
        self, system: System, functions: Sequence[str], called: Set[str], begin: BeginLibrary | None
    ) -> Program:
        """Return the Program with the stepper and, for runs, with the functions that may be compiled later. ``called``
        are the names that steps call. If ``begin`` returns a Program, this is the result. Raises ModelError if the
        method has no stepper for the System."""
        data = method_data(self.method, system, self.described.simulation.step)
        if self.own_settings:
            data = self._with_settings(data)
        if begin is not None and (known := begin(system, data, functions, self.target.names)) is not None:
            return known
        program = self._schedule(system, data, functions)
        if not (self.for_runs and self.selection.whole):
            return program
        start = self.described.simulation.start
        early = set(Selection(None, start).functions(list(system.functions), called, implicit=self.method.implicit))
        if system.multipliers and start != "equilibrium":  # runs take other functions, and analyses the residual
            early -= {"residual"} - self.method.calls(system)
        return replace(program, later=functions_for_later(program, early))

    def _with_settings(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return the data of the described method with the described settings as defaults. Raises DescriptionError."""
        described = self.described
        try:
            return with_settings(data, described.simulation.settings)
        except UsageError as error:
            where = f"{described.places.get('simulation.settings', described.name)} (simulation.settings)"
            raise DescriptionError([Problem(where, p.what, p.hint) for p in error.problems]) from None

    def _equations(self, document: Document, sample: Sample | None) -> Equations:
        """Return the System prepared for the method, the selected functions, the names that steps call, and a refusal.
        The refusal is the reason for which there is no stepper, empty if there is one. ``sample`` is the longer
        document that is meant, if any."""
        derive = partial(derive_system, document, self.front_end)
        if self.selection.start == REST:
            return self._equations_about_rest(derive)
        system, called = self._called_functions(derive)
        if self.target.steppers:
            system = self.method.prepared(system)
        if sample is not None:
            system = replace(system, sample=sample)
        functions = self.selection.functions(list(system.functions), called, implicit=self.method.implicit)
        refusal = "" if self.target.steppers else f"{self.target.language} has functions only"
        return system, functions, called, refusal

    def _called_functions(self, derive: Derive) -> tuple[System, Set[str]]:
        """Return the System with the selected terms and the set of names that the method calls. Without a selection,
        terms that the method needs and that are derived on request only are added."""
        method, system = self.method, derive(self.selection.terms)
        steps = method.calls(system)
        called = steps.union(method.terms(bool(system.multipliers), bool(system.states), "mass" in system.functions))
        absent = called - set(system.functions)
        lacking = [
            name
            for name in TERMS
            if name in absent and (TERMS[name].on_request or (TERMS[name].quadratic and name in steps))
        ]
        if lacking and self.selection.terms is None:
            system = derive([*(name for name in system.functions if name in TERMS), *lacking])
        return system, called

    def _equations_about_rest(self, derive: Derive) -> Equations:
        """Return System and functions for linear models about rest, no called names, and a refusal of steppers."""
        described, system = self.described, derive(None)
        holding = {
            "constraints": system.multipliers,
            "states": system.states,
            "outputs": system.outputs,
            "samples": system.sampled,
            "absolute": described.joints,
        }
        facts = {name for name, parts in holding.items() if parts}
        facts |= set() if system.multipliers else {"unconstrained"}
        disturbed = bool(system.inputs or described.disturbances)
        terms = linear_terms(system.functions, disturbed=disturbed, states=bool(system.states), moving=False)
        if any(name not in system.functions and TERMS[name].exists_with(facts) for name in terms):
            system = derive(terms)
        functions = [name for name in system.functions if name in terms or name not in TERMS or TERMS[name].of_events]
        return system, functions, set(), "the library is of linear models about rest"


def functions_for_later(program: Program, early: Collection[str]) -> tuple[str, ...]:
    """Return the names of the functions of a Program that may be compiled later: not ``early``, nor called by an early
    one. Empty if these have fewer than ``_MUCH`` operations."""
    called = {function.same_as for function in program.functions if function.name in early}
    later = [function for function in program.functions if function.name not in early and function.name not in called]
    work = sum(function.operations for function in later)
    return tuple(function.name for function in later) if work >= _MUCH else ()
