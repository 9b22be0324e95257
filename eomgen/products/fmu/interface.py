"""Variables of an FMU with dependencies, from a Program: the data that model descriptions and C have in common."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from itertools import chain, count
from typing import Any

from eomgen.base.data import dataclass
from eomgen.codegen.program import Program
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.units.table import NAMED
from eomgen.products.fmu.dependencies import Dependencies, Known
from eomgen.products.fmu.units import FmuUnit, unit_of
from eomgen.system.description import Description
from eomgen.system.signals import Input
from eomgen.system.system import Quantity

#: Names in the form that FMI calls structured.
_IDENTIFIER = r"[A-Za-z_]\w*(\[\d+(,\d+)*\])?(\.[A-Za-z_]\w*(\[\d+(,\d+)*\])?)*"
_STRUCTURED = re.compile(rf"(?a:{_IDENTIFIER}|der\({_IDENTIFIER}\))")
#: In place of the token, which follows from all other texts.
NO_TOKEN = "{00000000-0000-0000-0000-000000000000}"


@dataclass(frozen=True)
class Variable:
    """A variable of the model description.

    Attributes
    ----------
    reference : value reference, the place among the variables
    kind : ``time``, ``parameter``, ``input``, ``q``, ``v``, ``z``, ``sampled`` (internal state), ``turns`` (reference
        of an angle over several turns), ``der_q``, ``der_v``, ``der_z``, ``output``, ``mode``, ``formula`` (an input
        that the scene gives) or ``indicator``; with ``dae`` ``switch``, ``algebraic`` (accelerations, then
        multipliers), ``residual`` and ``drift`` (constraints, then rates); with ``minimal`` ``minimal`` (independent
        coordinates, then velocities) and ``der_minimal``
    index : place in the array of the kind
    initial : ``exact``, ``approx`` or ``calculated``; empty for inputs and the time
    start : None if the equations give the value
    unit : name of one of the units, empty for none
    derivative : value reference of the state with this derivative
    lower, upper : ends of the range, if any
    reinit : whether the FMU sets the state at events
    """

    name: str
    reference: int
    kind: str
    index: int
    causality: str
    variability: str
    initial: str = ""
    start: float | None = None
    unit: str = ""
    description: str = ""
    derivative: int | None = None
    lower: float | None = None
    upper: float | None = None
    reinit: bool = False


@dataclass(frozen=True)
class Unknown:
    """An unknown in the model structure of an FMU.

    Attributes
    ----------
    reference : value reference
    dependencies : value references in order; None for all
    kinds : of the dependencies
    """

    reference: int
    dependencies: tuple[int, ...] | None = None
    kinds: tuple[str, ...] = ()


@dataclass(frozen=True)
class About:
    """Author, version and licence of the model; texts that the user leaves out are empty.

    Attributes
    ----------
    license : name, as MIT or proprietary
    license_text : the licence in full
    description : in place of the scene's
    """

    author: str = ""
    version: str = ""
    copyright: str = ""
    license: str = ""
    license_text: str = ""
    description: str = ""


@dataclass(frozen=True)
class Options:
    """Options of the exported interface.

    Attributes
    ----------
    version : 2 or 3
    types : of ``me`` (model exchange) and ``cs`` (co-simulation)
    inputs : names of inputs with a formula that importers may set
    dae : whether the FMU can leave accelerations and multipliers to the importer, see ``dae.py``
    arrays : whether vectors are arrays, see ``arrays.py``
    about : author, version, copyright, licence and description of the model
    minimal : whether states of model exchange are independent coordinates and velocities in place of q and v
    """

    version: int
    types: tuple[str, ...]
    inputs: tuple[str, ...] = ()
    dae: bool = False
    arrays: bool = False
    about: About = About()
    minimal: bool = False


@dataclass(frozen=True)
class Interface:
    """The interface of an FMU: variables, units and options, from which all files follow.

    Attributes
    ----------
    name, description : of the model
    variables : in the order of the value references
    units : of the variables
    provides_derivatives : whether the FMU has directional and adjoint derivatives
    token : instantiation token, which follows from all other texts
    doubts : findings on the run of the scene that steps of other sizes share, for the log of co-simulation
    """

    program: Program
    options: Options
    name: str
    description: str
    variables: tuple[Variable, ...]
    units: tuple[FmuUnit, ...]
    provides_derivatives: bool = False
    token: str = NO_TOKEN
    doubts: tuple[str, ...] = ()

    @property
    def identifier(self) -> str:
        """Name of the binary, and prefix of all functions."""
        return self.program.prefix

    @property
    def version(self) -> int:
        return self.options.version

    @property
    def exchange(self) -> bool:
        """Whether the FMU has model exchange."""
        return "me" in self.options.types

    @property
    def simulation(self) -> bool:
        """Whether the FMU has co-simulation."""
        return "cs" in self.options.types

    @cached_property
    def by_kind(self) -> Mapping[str, tuple[Variable, ...]]:
        """Variables of each kind, in order."""
        kinds: dict[str, list[Variable]] = {}
        for item in self.variables:
            kinds.setdefault(item.kind, []).append(item)
        return {kind: tuple(items) for kind, items in kinds.items()}

    def of(self, kind: str) -> tuple[Variable, ...]:
        """Return the variables of a kind."""
        return self.by_kind.get(kind, ())

    @property
    def states(self) -> tuple[Variable, ...]:
        """Continuous states, in the order of the derivatives."""
        positions = self.of("minimal") if self.options.minimal else (*self.of("q"), *self.of("v"))
        return (*positions, *self.of("z"))

    @cached_property
    def dependencies(self) -> Dependencies:
        """Dependencies of the unknowns."""
        return Dependencies(self.program, [item.index for item in self.of("input")])

    @cached_property
    def places(self) -> Mapping[Known, int]:
        """Value references by kind and place in the array of the kind."""
        return {(item.kind, item.index): item.reference for item in self.variables}

    # -- the model structure -------------------------------------------------------------------------------------------

    @property
    def outputs(self) -> tuple[Unknown, ...]:
        """Outputs with dependencies."""
        return tuple(self._unknown(item) for item in self.of("output"))

    @property
    def derivatives(self) -> tuple[Unknown, ...]:
        """Derivatives of the states with dependencies."""
        return tuple(self._unknown(item) for item in self.variables if item.derivative is not None)

    @property
    def initial_unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the initialisation with dependencies: outputs, derivatives, corrected states."""
        corrected = ("minimal",) if self.options.minimal else ("q", "v")
        return tuple(
            self._unknown(item, initial=True)
            for item in self.variables
            if item.causality == "output"
            or item.derivative is not None
            or (item.kind in corrected and item.initial in ("approx", "calculated"))
        )

    @property
    def indicators(self) -> tuple[Unknown, ...]:
        """Event indicators."""
        return tuple(Unknown(item.reference) for item in self.of("indicator"))

    def _unknown(self, item: Variable, *, initial: bool = False) -> Unknown:
        constrained = bool(self.program.sizes["lam"])
        dependencies = None
        if not (self.options.minimal or (initial and constrained)):
            dependencies = self.dependencies.of(item.kind, item.index)
        if dependencies is None:
            return Unknown(item.reference)
        kinds, places = ["time", "input", "q", "v", "z"], self.places
        kinds += ["parameter", "sampled", "mode"] if initial or self.version == 3 else []
        linear, others = dependencies
        # sampled internal states are another kind
        moved = (key if key[0] != "z" or key in places else ("sampled", key[1]) for key in others)
        of_kinds = [places[key] for key in moved if key[0] in kinds and key in places]
        return unknown_by(item.reference, [places[key] for key in linear if key in places], of_kinds)

    # -- names ---------------------------------------------------------------------------------------------------------

    @cached_property
    def types(self) -> Mapping[str, str]:
        """Names of types, as TorsionalStiffness, by units."""
        taken, result = {item.name for item in self.variables}, dict[str, str]()
        taken |= {name.partition("[")[0] for name in taken}
        for unit in self.units:
            if unit.name in NAMED:
                name = "".join(word.capitalize() for word in NAMED[unit.name].split()[1:])
                result[unit.name] = f"{name}Type" if name in taken else name
        return result

    @property
    def structured(self) -> bool:
        """Whether all names have the structured form."""
        return all(_STRUCTURED.fullmatch(item.name) for item in self.variables)

    @property
    def projects(self) -> bool:
        """Whether completed steps of model exchange may ask for a correction of the states."""
        turns = any(factor["group"] != "R" for factor in self.program.factors)
        return bool(self.program.sizes["lam"]) or turns


def event_rows(program: Program) -> list[Mapping[str, Any]]:
    """Return the events of a Program."""
    return list(program.method["events"]["rows"]) if "events" in program.method else []


def mode_parameters(program: Program) -> list[int]:
    """Return the places of the modes among the parameters."""
    return [int(mode["parameter"]) for mode in program.method["events"]["modes"]] if event_rows(program) else []


def interface_of(program: Program, described: Description, options: Options) -> Interface:
    """Return the interface of a Program with a method."""
    made = _Variables(program, described, options)
    text = options.about.description or described.description or program.description
    units = tuple(made.units.values())
    return Interface(program, options, described.name, text, tuple(made.variables), units)


#: Causality, variability and ``initial`` of variables by kind; of all other kinds ``_LOCAL``.
_ATTRIBUTES: Mapping[str, tuple[str, str, str]] = {
    "time": ("independent", "continuous", ""),
    "parameter": ("parameter", "tunable", "exact"),
    "input": ("input", "continuous", ""),
    "output": ("output", "continuous", "calculated"),
    "switch": ("structuralParameter", "fixed", ""),
    **dict.fromkeys(("q", "v", "z"), ("local", "continuous", "exact")),
    **dict.fromkeys(("turns", "sampled", "mode"), ("local", "discrete", "exact")),
}
_LOCAL = ("local", "continuous", "calculated")


class _Variables:
    """Makes the variables of an FMU in the order of the value references, and collects the units."""

    def __init__(self, program: Program, described: Description, options: Options) -> None:
        """List the variables of an FMU: time, parameters, inputs, states, derivatives and results."""
        self.program, self.described, self.minimal = program, described, options.minimal
        self.variables: list[Variable] = []
        self.units: dict[str, FmuUnit] = {}
        self.names: set[str] = set()
        self._add("time", "time", 0, unit="s", description="time")
        modes = mode_parameters(program)
        for index, item in enumerate(program.parameters):
            if index not in modes:
                lower, upper = (_normal(end) for end in program.bounds.get(item.name, (None, None)))
                self._quantity(item, "parameter", index, start=item.value, lower=lower, upper=upper)
        chosen = {item.name for item in described.inputs if not item.given} | set(options.inputs)
        for index, signal in enumerate(described.inputs):
            if signal.name in chosen:
                self._quantity(signal, "input", index, start=_start_of(signal, described))
        self._states()
        self._derivatives()
        self._results(modes, chosen, options)

    def _add(self, name: str, kind: str, index: int, *, unit: str = "", description: str = "", **more: Any) -> None:
        reference = len(self.variables)
        if name in self.names:
            others = (f"{kind}{number}.{name}" for number in chain([""], count(2)))
            name = next(candidate for candidate in others if candidate not in self.names)
        self.names.add(name)
        si_unit = unit_of(unit)
        if si_unit is not None:
            self.units.setdefault(si_unit.name, si_unit)
        elif unit not in ("", "1"):
            description = f"{description} ({unit})".strip()
        causality, variability, initial = _ATTRIBUTES.get(kind, _LOCAL)
        more = {"initial": initial, "unit": "" if si_unit is None else si_unit.name, "description": description, **more}
        self.variables.append(Variable(name, reference, kind, index, causality, variability, **more))

    def _quantity(self, item: Quantity | Input, kind: str, index: int, **more: Any) -> None:
        """Add a variable with the name, the unit and the description of a quantity."""
        self._add(item.name, kind, index, unit=item.unit, description=item.description, **more)

    def _states(self) -> None:
        """Add positions, velocities and internal states; ``reinit`` marks states that events or constraints may
        change."""
        program, rows = self.program, event_rows(self.program)
        samples = program.method.get("samples", {})
        sampled = {int(row["state"]) for row in samples.get("rows", ())}
        for item in samples.get("controllers", ()):
            sampled |= {int(state) for key in ("signal", "value", "memory") for state in item[f"{key}_states"]}
        acting = {item["block"] for row in rows for item in row["assignments"]}
        acting |= {"v"} if any(row["action"] == "impact" for row in rows) else set()
        constrained = bool(program.sizes["lam"])
        corrected = constrained or any(factor["group"] != "R" for factor in program.factors)
        turns = program.sizes["q"] - len(program.angles)
        for index, item in enumerate(program.coordinates):
            kind = "q" if index < turns else "turns"
            self._state(kind, index, item, item.value, corrected or "q" in acting)
        for index, item in enumerate(program.velocities):
            self._state("v", index, item, item.value, constrained or "v" in acting)
        for index, (item, start) in enumerate(zip(program.states, program.initial_z, strict=True)):
            self._state("sampled" if index in sampled else "z", index, item, start, "z" in acting)
        if self.minimal:
            self._independent()

    def _independent(self) -> None:
        """Add the independent coordinates and velocities as states, ``minimal.q[k]`` and ``minimal.v[k]``. At other
        configurations the FMU chooses other components of q and v for these."""
        sizes = self.program.sizes
        positions, velocities = sizes["v"] - sizes["holonomic"], sizes["v"] - sizes["lam"]
        for index in range(positions + velocities):
            block, number = ("q", index) if index < positions else ("v", index - positions)
            text = "coordinate" if block == "q" else "velocity"
            description = f"independent {text} {number}"
            self._add(f"minimal.{block}[{number}]", "minimal", index, description=description, reinit=True)

    def _state(self, kind: str, index: int, item: Quantity, start: float, reinit: bool) -> None:
        """Add a state of ``kind`` named as a quantity; q and v of constrained scenes are guesses (``approx``)."""
        guessed = bool(self.program.sizes["lam"]) and kind in ("q", "v")
        reinit = reinit and not (self.minimal and kind != "z") and kind in ("q", "v", "z")
        more = {"initial": "approx"} if guessed else {}
        self._quantity(item, kind, index, start=start, reinit=reinit, **more)

    def _derivatives(self) -> None:
        for kind in ("minimal", "z") if self.minimal else ("q", "v", "z"):
            for state in [item for item in self.variables if item.kind == kind]:
                name, rate = f"der({state.name})", _rate(state.unit)
                self._add(name, f"der_{kind}", state.index, unit=rate, derivative=state.reference)

    def _results(self, modes: Sequence[int], chosen: Collection[str], options: Options) -> None:
        """Add outputs, modes, inputs by formula, and event indicators."""
        program, offset = self.program, 0
        for item in program.outputs:
            for component in range(item.size):
                name = item.name if item.size == 1 else f"{item.name}[{component}]"
                self._add(name, "output", offset, unit=item.unit, description=item.description)
                offset += 1
        for index, parameter in enumerate(modes):
            item = program.parameters[parameter]
            self._quantity(item, "mode", index, start=item.value)
        for index, signal in enumerate(self.described.inputs):
            if signal.name not in chosen:
                self._quantity(signal, "formula", index)
        if options.version == 3 and "me" in options.types:
            for index, row in enumerate(event_rows(program)):
                text = row["description"] or f"roots are the event {row['name']}"
                self._add(f"event.{row['name']}", "indicator", index, description=text)
        if options.dae:
            self._differential_algebraic()

    def _differential_algebraic(self) -> None:
        """Add the variables of the system by FMI-LS-DAE: switch, algebraic, residual and ``drift``."""
        program, velocities = self.program, self.program.velocities
        text = "true: the importer solves for accelerations and multipliers (FMI-LS-DAE)"
        self._add("dae", "switch", 0, start=0.0, description=text)
        rows = [(name, unit.startswith("1")) for name, unit in zip(program.multipliers, program.row_units, strict=True)]
        balances = {"m/s^2": "N", "rad/s^2": "N m"}
        described: dict[str, list[tuple[str, str]]] = {
            "algebraic": [
                *((f"acceleration of {item.name}", _rate(item.unit)) for item in velocities),
                *((f"multiplier of {name}", "N m" if turns else "N") for name, turns in rows),
            ],
            "residual": [
                *((f"equation of motion of {item.name}", balances.get(_rate(item.unit), "")) for item in velocities),
                *((f"acceleration of the constraint {name}", "1/s^2" if turns else "m/s^2") for name, turns in rows),
            ],
            "drift": [
                *((f"constraint {name}", "" if turns else "m") for name, turns in rows[: program.sizes["holonomic"]]),
                *((f"rate of the constraint {name}", "1/s" if turns else "m/s") for name, turns in rows),
            ],
        }
        for kind, items in described.items():
            for index, (description, unit) in enumerate(items):
                self._add(f"dae.{kind}[{index}]", kind, index, unit=unit, description=description)


def unknown_by(reference: int, linear: Collection[int], others: Collection[int]) -> Unknown:
    """Return an unknown by the value references of knowns with constant derivatives and of all further ones."""
    every = sorted({*linear, *others})
    constant = {*linear} - {*others}
    return Unknown(reference, tuple(every), tuple("constant" if key in constant else "dependent" for key in every))


def _normal(end: float | None) -> float | None:
    """Return the end of a range; the next normal number for tiny ones, which readers of numbers may refuse."""
    if end is None or end == 0.0 or abs(end) >= sys.float_info.min:
        return end
    return math.copysign(sys.float_info.min, end)


def _rate(unit: str) -> str:
    """Return the unit of a rate in one fraction: m/s^2 of m/s; none of no unit."""
    if unit in ("", "1"):
        return unit and "1/s"
    return f"{unit[:-2]}/s^2" if unit.endswith("/s") else f"{unit}/s"


def _start_of(signal: Input, described: Description) -> float:
    """Return the value of an input at the start: of the formula at t = 0, or 0."""
    result = sum(amplitude * math.cos(phase) for amplitude, _, phase in signal.harmonics)
    if signal.formula is None:
        return result
    values = {("parameter", name, 0): value for name, value in described.values({}).items()}
    values["time", "", 0] = 0.0
    try:
        result += evaluate(signal.formula, lambda symbol: values[symbol.kind, symbol.name, symbol.index])
    except (ArithmeticError, KeyError, ValueError, EomgenError):
        return 0.0
    return result if math.isfinite(result) else 0.0
