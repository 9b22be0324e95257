"""The controller of a scene without its plant: measured signals as inputs, sampled states or controllers with memory,
and commands as outputs, as a System of its own.

A scene with sampled states has a digital controller, which consists of these states; continuous controllers and states
then belong to the plant. Without sampled states the controllers of the scene are the controller, with the states that
they read. Formulas of the controller are the formulas of the scene: quantities of the plant are replaced by inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property

from eomgen.base.data import replace
from eomgen.errors import ModelError, Problem
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import VECTORS, Application, Formula, Operation, Symbol, infix
from eomgen.formula.recording import record
from eomgen.mechanics.terms.events import sample_rows, samples
from eomgen.scene.control.model import Controller
from eomgen.scene.reading.formula_units import unit_of_symbol
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape
from eomgen.system.events import mode_parameter
from eomgen.system.signals import SampledController, State
from eomgen.system.system import Block, Facts, Function, Quantity, System

#: Kinds of symbols that are not quantities of the plant.
_SIGNALS = frozenset({"time", "parameter", "input", "state", "controller", "number"})
#: Kinds of symbols that follow from the equations of motion, which no sensor gives.
_OF_EQUATIONS = {"tau": "inverse dynamics", "gravity": "inverse dynamics", "energy": "an energy of the machine"}
#: Suffix of the name of the model.
SUFFIX = "_controller"


def derive_controller(scene: Scene) -> System:
    """Return the System of the controller of a scene.

    ``inputs`` are measured signals, named as outputs of the scene with the same formula, else as the quantity in
    formulas, and then inputs of the scene; ``outputs`` are the values that the plant reads, *commands*. Functions are
    ``commands`` and, if there are such states, ``samples`` or ``rates``.

    Raises
    ------
    ModelError
        The scene has no controller; formulas need the equations of motion; an event or a caller's function is part of
        the controller.
    """
    parts = _ControllerParts(scene)
    tape = _ControllerTape(parts)
    functions = {function.name: function for function in tape.functions()}
    return System(
        name=f"{scene.name}{SUFFIX}",
        tape=tape.tape,
        factors=(),
        functions=functions,
        parameters=parts.parameters,
        inputs=parts.inputs,
        outputs=tuple(quantity for quantity, _ in parts.commands),
        bodies=(),
        initial_q=(),
        initial_v=(),
        dof_parent=(),
        facts=Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False),
        states=tuple(Quantity(item.name, item.initial, 1, item.unit, item.description) for item in parts.states),
        sampled=sample_rows(tape),
        controllers=parts.sampled,
        notes=parts.notes,
        description=f"controller of {scene.name}" + (f": {scene.description}" if scene.description else ""),
        defaults=dict(vars(scene.simulation)),
    )


class _ControllerParts:
    """States, formulas, commands and inputs of a scene's controller, with inputs in place of quantities of the plant.

    With sampled states the controller is digital and has these states alone; else it has all ``[controllers]`` with
    states.

    Attributes
    ----------
    own : names of the states of the controller
    states, commands : states and values that the plant reads, with formulas that contain inputs of the controller only
    sampled : sampled controllers with functions in C, of a digital controller
    measured : inputs by symbol or formula of the scene, in the order of their first use
    """

    def __init__(self, scene: Scene) -> None:
        """Separate the controllers of a scene from the plant. Raises ModelError if the scene has no controller, if an
        event resets one of its states, if a sampled controller is a function of the caller, or if a formula needs the
        equations of motion."""
        self.scene = scene
        self.digital = any(state.sampling is not None for state in scene.states)
        self._by_name: dict[str, Controller] = {item.name: item for item in scene.controllers}
        self._states: dict[str, State] = {item.name: item for item in scene.states}
        self._joints = {joint.name: joint.type for joint in scene.joints}
        self._sizes = {
            (letter, joint.name): getattr(joint.kind, f"{letter}_size") for joint in scene.joints for letter in "qv"
        }
        self._outputs = self._measurable_outputs()
        self.measured: dict[Formula, Quantity] = {}
        self._used: set[str] = set()  # inputs of the scene
        sampled = {state.name for state in scene.states if state.sampling is not None}
        self.own = sampled or self._states_of_controllers()
        read = self._commands_of_the_plant()
        if not read:
            fault = "the scene has no controller: neither sampled states nor [controllers] [E0491]"
            hint = "sample and formula of a state, or with_controller(scene, law) of a design"
            raise ModelError(Problem(scene.name, fault, hint))
        self._check_actions()
        self.sampled = tuple(map(self._check, scene.sampled)) if self.digital else ()
        self.controllers: dict[str, Formula] = {}
        self.states = tuple(self._state(item) for item in scene.states if item.name in self.own)
        self.commands = tuple(self._command(name) for name in read)

    # -- the controller and its commands -------------------------------------------------------------------------------

    def _states_of_controllers(self) -> set[str]:
        """Return the names of the continuous states that controllers read, directly or by rates of other states,
        without states that forces read directly."""
        direct = _names("state", self._forces())
        reached: set[str] = set()
        open_names = _names("state", (item.output for item in self.scene.controllers))
        while open_names := open_names - reached - direct:
            reached |= open_names
            open_names = _names("state", (self._states[name].rate for name in open_names))
        return reached

    def _commands_of_the_plant(self) -> list[str]:
        """Return the names of the commands that forces and rates read, or outputs, or of all commands."""
        rates = (state.rate for state in self.scene.states if state.name not in self.own)
        return (
            self._commands_in([*self._forces(), *rates])
            or self._commands_in([value for output in self.scene.outputs for value in output.values])
            or [name for name in (*self._by_name, *sorted(self.own)) if self._is_command(name)]
        )

    def _forces(self) -> Iterator[Formula]:
        return (formula for element in self.scene.elements for formula, _ in element.formulas())

    def _commands_in(self, formulas: Sequence[Formula]) -> list[str]:
        """Return the names of the controllers and states whose values formulas of the plant read, controllers first, in
        the order of the scene. Controllers that are not commands are replaced by their formulas."""
        names: set[str] = set()
        open_formulas, seen = list(formulas), set[str]()
        while open_formulas:
            for symbol in symbols(open_formulas.pop()):
                if symbol.kind not in ("state", "controller") or symbol.name in seen:
                    continue
                seen.add(symbol.name)
                if self._is_command(symbol.name):
                    names.add(symbol.name)
                elif symbol.kind == "controller":
                    open_formulas.append(self._by_name[symbol.name].output)
        return [name for name in (*self._by_name, *self._states) if name in names]

    def _is_command(self, name: str) -> bool:
        """Return whether a name of a controller or state is a value that the controller computes and the plant may
        read. Of a digital controller these are its states and the controllers that depend on these and parameters
        alone."""
        if name in self._states:
            return self.digital and name in self.own
        return not self.digital or self._is_held(name)

    def _is_held(self, name: str) -> bool:
        """Return whether the output of a controller depends on sampled states and parameters alone."""
        symbols_of = list(self._expand(self._by_name[name].output))
        states = {symbol.name for symbol in symbols_of if symbol.kind == "state"}
        return bool(states) and states <= self.own and all(item.kind in ("state", "parameter") for item in symbols_of)

    def _expand(self, formula: Formula) -> Iterator[Symbol]:
        """Yield the symbols of a formula with controllers written out."""
        for symbol in symbols(formula):
            if symbol.kind == "controller":
                yield from self._expand(self._by_name[symbol.name].output)
            else:
                yield symbol

    def _check_actions(self) -> None:
        """Raise ModelError if an event changes a state of the controller."""
        for event in self.scene.events:
            for symbol, _ in event.resets:
                if symbol.kind == "state" and symbol.name in self.own:
                    fault = (
                        f"the event {event.name} resets the state {symbol.name}, and the controller has no"
                        f" events [E0492]"
                    )
                    raise ModelError(Problem(event.place, fault, "a formula of the sampled state for the reset"))

    def _check(self, item: SampledController) -> SampledController:
        if not item.function:
            fault = "the function of this sampled controller is the caller's, so there is no C of it [E0493]"
            hint = 'source = "controller.c", and the name of the function'
            raise ModelError(Problem(f"controllers.{item.name}", fault, hint))
        return item

    # -- formulas without the plant ------------------------------------------------------------------------------------

    def _measurable_outputs(self) -> dict[Formula, Quantity]:
        """Return the outputs of the scene that a sensor may give, by the formula of each component. These depend on
        quantities of the plant and fixed parameters alone, need no equations of motion, and have no name of an
        input."""
        fixed = {item.name for item in self.scene.parameters if not item.tunable}
        taken = {item.name for item in self.scene.inputs}
        known: dict[Formula, Quantity] = {}
        for output in self.scene.outputs:
            if output.name in taken:
                continue
            for index, value in enumerate(output.values):
                used = symbols(value)
                plant = {symbol for symbol in used if symbol.kind not in _SIGNALS}
                others = all(symbol.kind == "parameter" and symbol.name in fixed for symbol in used - plant)
                if plant and others and not any(symbol.kind in _OF_EQUATIONS for symbol in plant):
                    name = output.name if len(output.values) == 1 else f"{output.name}[{index}]"
                    known.setdefault(value, Quantity(name, 0.0, 1, output.unit, output.description))
        return known

    def _state(self, state: State) -> State:
        where = f"states.{state.name}"
        if state.sampling is None:
            return replace(state, rate=self._alone(state.rate, where))
        formula = self._alone(state.sampling.formula, state.sampling.place or where)
        return replace(state, sampling=replace(state.sampling, formula=formula))

    def _command(self, name: str) -> tuple[Quantity, Formula]:
        """Return a value of the controller that the plant reads, with its formula."""
        item = self._states[name] if name in self._states else self._by_name[name]
        quantity = Quantity(name, 0.0, 1, item.unit, item.description)
        if isinstance(item, State):
            return quantity, Symbol("state", name)
        return quantity, self._alone(item.output, f"controllers.{name}")

    def _alone(self, formula: Formula, where: str) -> Formula:
        """Return a formula with inputs in place of quantities of the plant, which are added to ``measured``. The last
        argument is the place in the scene for messages. Raises ModelError for quantities from the equations of
        motion."""
        if formula in self._outputs:
            return self._input(formula, self._outputs[formula])
        if isinstance(formula, Application):
            return replace(formula, argument=self._alone(formula.argument, where))
        if isinstance(formula, Operation):
            return replace(formula, arguments=tuple(self._alone(item, where) for item in formula.arguments))
        return self._symbol(formula, where) if isinstance(formula, Symbol) else formula

    def _symbol(self, symbol: Symbol, where: str) -> Formula:
        """Return the formula of the controller for a symbol of the scene: the symbol, a controller's formula, or an
        input. Raises ModelError for a mode, which events switch, and for quantities that follow from the equations of
        motion."""
        match symbol.kind:
            case "time" | "parameter" | "number":
                modes = {mode_parameter(name): name for name in self.scene.modes}
                if symbol.kind == "parameter" and symbol.name in modes:
                    mode = modes[symbol.name]
                    fault = f"the mode {mode} is switched by events, and the controller has no events [E0495]"
                    raise ModelError(Problem(where, fault, "a sampled state in place of the mode"))
                return symbol
            case "input":
                self._used.add(symbol.name)
                return symbol
            case "state" if symbol.name in self.own:
                return symbol
            case "controller" if not self._continuous(symbol.name):
                return self._alone(self._by_name[symbol.name].output, f"controllers.{symbol.name}")
            case kind if kind in _OF_EQUATIONS:
                text = infix(symbol, self._size)
                fault = f"{text} is {_OF_EQUATIONS[kind]}, which follows from the equations of the plant [E0494]"
                hint = f"an input in its place, fed by the C of the whole scene; or a controller without {text}"
                raise ModelError(Problem(where, fault, hint))
        unit = unit_of_symbol(symbol, self._joints, {})
        if symbol.kind in ("state", "controller"):
            item = self._states[symbol.name] if symbol.kind == "state" else self._by_name[symbol.name]
            return self._input(symbol, Quantity(symbol.name, 0.0, 1, item.unit, item.description))
        return self._input(symbol, Quantity(infix(symbol, self._size), 0.0, 1, unit))

    def _continuous(self, name: str) -> bool:
        """Return whether a controller depends on states outside of the controller; a digital controller measures such
        outputs."""
        return any(
            item.kind == "state" and item.name not in self.own for item in self._expand(Symbol("controller", name))
        )

    def _size(self, symbol: Symbol) -> int:
        return 3 if symbol.kind in VECTORS else int(self._sizes.get((symbol.kind, symbol.name), 1))

    def _input(self, formula: Formula, quantity: Quantity) -> Symbol:
        self.measured.setdefault(formula, quantity)
        return Symbol("input", self.measured[formula].name)

    # -- signals -------------------------------------------------------------------------------------------------------

    def formulas(self) -> Iterator[Formula]:
        """Yield all formulas of the controller."""
        for state in self.states:
            yield state.rate if state.sampling is None else state.sampling.formula
        yield from (formula for _, formula in self.commands)

    @cached_property
    def inputs(self) -> tuple[Quantity, ...]:
        """Measured signals, then inputs of the scene."""
        inputs = (item for item in self.scene.inputs if item.name in self._used)
        return (*self.measured.values(), *(Quantity(i.name, 0.0, 1, i.unit, i.description) for i in inputs))

    @cached_property
    def parameters(self) -> tuple[Quantity, ...]:
        """Tunable parameters that formulas of the controller read."""
        used = _names("parameter", self.formulas())
        tunable = (item for item in self.scene.parameters if item.tunable and item.name in used)
        return tuple(Quantity(item.name, item.value, 1, item.unit, item.description) for item in tunable)

    @property
    def notes(self) -> tuple[str, ...]:
        """A note with the names of continuous controllers that a digital controller leaves to the plant; empty without
        them."""
        left = [item.name for item in self.scene.controllers if self.digital and self._continuous(item.name)]
        names = ", ".join(left)
        return (f"{names}: continuous in the scene, so a part of the plant",) if left else ()


def _names(kind: str, formulas: Iterable[Formula]) -> set[str]:
    """Return the names of the symbols of a kind in formulas."""
    return {symbol.name for formula in formulas for symbol in symbols(formula) if symbol.kind == kind}


class _ControllerTape:
    """The tape of a controller, with its parameters, states, inputs and time as inputs of the tape."""

    def __init__(self, parts: _ControllerParts) -> None:
        self.scene = parts
        self.tape = Tape()
        self.algebra = Algebra(self.tape)
        self.quantities = self
        fixed = {item.name: self.algebra.scalar(item.value) for item in parts.scene.parameters if not item.tunable}
        self._scalars: Mapping[tuple[str, str], Scalar] = {
            **{("parameter", name): value for name, value in fixed.items()},
            **self._block("parameter", "p", [item.name for item in parts.parameters]),
            **self._block("state", "z", [item.name for item in parts.states]),
            **self._block("input", "u", [item.name for item in parts.inputs]),
            ("time", ""): Scalar(self.tape, self.tape.input("t", 0)),
        }

    def _block(self, kind: str, block: str, names: Sequence[str]) -> dict[tuple[str, str], Scalar]:
        return {(kind, name): Scalar(self.tape, self.tape.input(block, k)) for k, name in enumerate(names)}

    def formula(self, formula: Formula) -> Scalar:
        """Record a formula of the controller."""
        return record(self.algebra, formula, lambda symbol: self._scalars[symbol.kind, symbol.name])

    def functions(self) -> Iterator[Function]:
        """Yield the functions ``commands`` and, for a controller with states, ``samples`` (digital) or ``rates``
        (continuous). Each takes those blocks among "p", "t", "z" and "u" that the controller has."""
        made: list[tuple[str, str, list[Block]]] = []
        with self.tape.block("commands"):
            refs = tuple(self.formula(formula).ref for _, formula in self.scene.commands)
        commands = Block("y", (len(refs),), refs, "commands")
        made.append(("commands", "commands at present states and measured signals", [commands]))
        if self.scene.digital:
            made.append(("samples", "new values of the sampled states", samples(self)))
        elif self.scene.states:
            with self.tape.block("rates"):
                refs = tuple(self.formula(item.rate).ref for item in self.scene.states)
            made.append(("rates", "time derivatives of the states", [Block("zdot", (len(refs),), refs, "rates")]))
        every = [ref for _, _, blocks in made for block in blocks for ref in block.refs]
        timed = any(symbol.block == "t" for symbol in self.tape.depends_on(every))
        present = {"p": self.scene.parameters, "t": timed, "z": self.scene.states, "u": self.scene.inputs}
        inputs = tuple(block for block, there in present.items() if there)
        yield from (Function(name, text, inputs, tuple(blocks)) for name, text, blocks in made)
