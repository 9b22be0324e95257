"""Reading of files with ``kind = "hamiltonian"``: every problem of a file is reported at once, by key and line."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from eomgen.base.data import replace
from eomgen.base.messages import NAME_RULE, is_legal, shown
from eomgen.errors import Message
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Operation
from eomgen.products.fields.documents.document import Dependence, Hamiltonian, HamiltonianTerm, NamedNumber, StateOutput
from eomgen.products.fields.documents.entries import FieldEntries, toml_file
from eomgen.products.fields.documents.schema import HamiltonianFile
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.reading.report import Report
from eomgen.scene.repeat import expand_repeats

#: Commands and functions for systems of fields, for messages.
OF_FIELDS = "eomgen sample or info, or eomgen.sampling.sample(...)"
#: Sections whose entries may repeat.
SECTIONS = ("parameters", "coordinates", "definitions", "hamiltonian", "outputs")
_OF_STATES = Scope("coordinates, momenta and parameters (H does not depend on time)", frozenset({"parameter", "state"}))


def load_hamiltonian(path: str | os.PathLike[str]) -> Hamiltonian:
    """Read a Hamiltonian system from a TOML file.

    Raises
    ------
    FileError, DescriptionError
        DescriptionError contains all faults of the content.
    """
    data, lines, file = toml_file(path)
    return hamiltonian_from_data(data, file=file, lines=lines)


def hamiltonian_from_data(
    data: Mapping[str, Any], *, file: str = "system", lines: Mapping[str, int | str] | None = None
) -> Hamiltonian:
    """Check nested data, in the form of a file of a Hamiltonian system, and return the system.

    ``file`` is the name in messages, ``lines`` the line or place of each key there.

    Raises
    ------
    DescriptionError
        With every problem that could be found.
    """
    report = Report(file, lines or {})
    if "mesh" in data:
        fault = "this is a system of fields on a mesh, and this command or function is for coordinates [E0759]"
        report.add("mesh", fault, OF_FIELDS)
        report.raise_problems()
    if "repeat" in data:
        data = expand_repeats(data, report, SECTIONS)
    result = _HamiltonianReader(data, report, HamiltonianFile, SECTIONS).read()
    report.raise_problems()
    assert result is not None  # without problems there is a system
    return result


class _HamiltonianReader(FieldEntries[HamiltonianFile]):
    def read(self) -> Hamiltonian | None:
        """Return the system; None if a problem has been reported."""
        data, report, file = self.data, self.report, self.file
        for name in self.left_out.intersection(data.get("coordinates", ())):
            entry = data["coordinates"][name]
            momentum = entry.get("momentum") if isinstance(entry, Mapping) else ""
            self.left_out.add(momentum if momentum and isinstance(momentum, str) else f"p_{name}")
        parameters = self.parameters()
        pairs = self.coordinates(parameters)
        if not pairs:
            return None
        coordinates, momenta = zip(*pairs, strict=True)
        momentum = {item.name for item in momenta}
        keyed_names = [(f"coordinates.{q.name}", item.name) for q, p in pairs for item in (q, p)]
        time = "t is the time, of which H does not depend [E0764]", "another name"
        self.check_names([*self.keys_in("parameters"), *keyed_names, *self.keys_in("definitions")], {"t": time})
        for key, name in self.keys_in("outputs"):
            if not is_legal(name):
                report.add(key, f"the name {shown(name)} is not legal [E0715]", NAME_RULE)
        states = tuple(item.name for pair in pairs for item in pair)
        names = SceneNames(parameters=dict.fromkeys((item.name for item in parameters), True), states=states)
        self.definitions(names, _OF_STATES)
        names = replace(names, definitions=self.defined)
        terms = self.terms(names, momentum)
        outputs = self.outputs(names)
        self.check_simulation()
        if report.noted:
            return None
        resting = self.check_momenta({symbol.name for term in terms for symbol in symbols(term.formula)}, pairs)
        return Hamiltonian(
            file.name,
            coordinates,
            momenta,
            tuple(terms),
            file.simulation,
            report.where("simulation.method") if "method" in file.simulation.model_fields_set else "",
            tuple(parameters),
            tuple(outputs),
            file.description,
            self.content_without("simulation"),
            definitions={name: item.text for name, item in self.defined.items()},
            notes=tuple(map(Message, (*self.note_on_unused(), *resting))),
        )

    def hint(self, error: FormulaError) -> str:
        if error.name == "p":
            return 'p_x for the momentum of x, or momentum = "p" in its coordinate'
        if error.name.startswith("v_"):
            return "the momentum: H has p_x**2/(2*m) in place of m*v_x**2/2"
        return super().hint(error)

    def coordinates(self, parameters: list[NamedNumber]) -> list[tuple[NamedNumber, NamedNumber]]:
        """Return each coordinate with the momentum, as numbers at the start; a file without coordinates is reported."""
        if not self.file.coordinates and not self.report.concerns("coordinates"):
            hint = "[coordinates] and x = { initial = [0.1, 0.0] }: the position and the momentum at the start"
            self.report.add("coordinates", "there is no coordinate [E0760]", hint)
        made = []
        for name, entry in self.file.coordinates.items():
            named = (name, entry.unit), (entry.momentum or f"p_{name}", entry.momentum_unit)
            pair = []
            for index, (label, unit) in enumerate(named):
                key = f"coordinates.{name}.initial[{index}]"
                value, formula = self.number(key, entry.initial[index], parameters)
                pair.append(NamedNumber(label, value, unit, formula=formula))
            made.append((pair[0], pair[1]))
        return made

    def terms(self, names: SceneNames, momenta: set[str]) -> list[HamiltonianTerm]:
        """Return the summands of H, each of momenta alone, coordinates alone, or both; a missing H is reported, faulty
        terms are left out. ``momenta`` are names."""
        entry = self.file.hamiltonian
        if entry in ("", {}):
            hint = 'hamiltonian = "p_x**2/2 + x**2/2", or a table [hamiltonian] of terms whose sum it is'
            if not self.report.concerns("hamiltonian"):
                self.report.add("hamiltonian", "the Hamiltonian is missing [E0766]", hint)
            return []
        table = entry if isinstance(entry, Mapping) else {"": entry}
        made = []
        for name, text in table.items():
            formula = self.formula(f"hamiltonian.{name}" if name else "hamiltonian", text, names, _OF_STATES)
            for part in [] if formula is None else summands(formula, momenta):
                made.append(HamiltonianTerm(name or "hamiltonian", part, _dependence(part, momenta)))
        return made

    def outputs(self, names: SceneNames) -> list[StateOutput]:
        made = []
        for name, entry in self.file.outputs.items():
            formula = self.formula(f"outputs.{name}", entry.formula, names, _OF_STATES)
            if formula is not None:
                made.append(StateOutput(name, formula, entry.unit))
        return made

    def check_simulation(self) -> None:
        run = self.file.simulation
        if "method" in run.model_fields_set and not run.method:
            self.report.add("simulation.method", "the method has no name [E0771]", 'method = "omf4", or no key')
        if "tolerance" in run.model_fields_set and run.method != "rk45":
            fault = "a tolerance belongs to rk45, and other methods take equal steps [E0767]"
            self.report.add("simulation.tolerance", fault, 'method = "rk45"')

    def check_momenta(self, used: Collection[str], pairs: Sequence[tuple[NamedNumber, NamedNumber]]) -> list[str]:
        """Report coordinates that stay at rest: neither the coordinate nor the momentum is among the names ``used`` by
        H. Return a note on each coordinate with a force on whose momentum H does not depend: dH/dp is zero."""
        notes = []
        for q, p in pairs:
            if q.name in used and p.name not in used:
                fault = f"hamiltonian: H does not depend on {p.name}, so {q.name} never moves"
                notes.append(f"{fault}; try: a kinetic energy, {p.name}**2/(2*m), in H")
            elif p.name not in used:
                fault = f"neither {q.name} nor {p.name} is in H, so both stay as they are [E0773]"
                self.report.add(f"coordinates.{q.name}", fault, "a term of H with them, or leave it out")
        return notes


def _states(formula: Formula) -> set[str]:
    return {symbol.name for symbol in symbols(formula) if symbol.kind == "state"}


def _dependence(formula: Formula, momenta: set[str]) -> Dependence:
    """Return whether a term is ``kinetic`` (of momenta alone), ``coupled`` (of both), or ``potential`` (others, also
    constants)."""
    states = _states(formula)
    return ("coupled" if states - momenta else "kinetic") if states & momenta else "potential"


def summands(formula: Formula, momenta: set[str]) -> list[Formula]:
    """Return summands of a formula, with sums multiplied out if their factor has parameters only.

    A definition stays whole, so that the C has it under its name, unless it is of coordinates and of momenta: its
    summands may be of either alone.
    """
    if not isinstance(formula, Operation) or (formula.label and _dependence(formula, momenta) != "coupled"):
        return [formula]
    arguments = formula.arguments
    if formula.name == "neg":
        return [-part for part in summands(arguments[0], momenta)]
    if formula.name in ("add", "sub"):
        second = summands(arguments[1], momenta)
        second = second if formula.name == "add" else [-part for part in second]
        return [*summands(arguments[0], momenta), *second]
    if formula.name in ("mul", "div") and not _states(arguments[1]):
        return [Operation(formula.name, (part, arguments[1])) for part in summands(arguments[0], momenta)]
    if formula.name == "mul" and not _states(arguments[0]):
        return [Operation("mul", (arguments[0], part)) for part in summands(arguments[1], momenta)]
    return [formula]
