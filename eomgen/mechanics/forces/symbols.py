"""Symbols of formulas as scalars on the tape: coordinates, points, force elements, parameters, inputs, time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from eomgen.errors import ModelError, Problem
from eomgen.formula.curves import Waves
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record, waves
from eomgen.mechanics.kinematics.points import Kinematics, rotation_vector
from eomgen.mechanics.tree.links import Mount, Tree
from eomgen.scene.joints.model import Frame
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, Vector
from eomgen.symbolic.tape import Tape
from eomgen.system.description import Point
from eomgen.system.signals import Input

#: Function from a force element to the value on the tape of a quantity of the element in formulas.
Offer = Callable[["Quantities", Any], Scalar]
#: By kind of quantity: the section of the elements with this quantity, and a description.
Offers = Mapping[str, tuple[str, Offer]]


class Quantities:
    """Values on the tape of the symbols of formulas, in joint coordinates.

    Parameters
    ----------
    scene : Scene
        The scene of the formulas.
    tree : Tree
        Bodies and joints on the tape.
    kinematics : Kinematics
        Poses, velocities and accelerations of the bodies.
    offered : mapping
        Quantities that force elements offer: by kind of symbol, the section of the elements and the recording function.
    """

    def __init__(self, scene: Scene, tree: Tree, kinematics: Kinematics, offered: Offers) -> None:
        """Number the inputs and states of a scene, and index its points, force elements and controllers by name."""
        self.scene = scene
        self.offered = offered
        self.tree = tree
        self.kinematics = kinematics
        self.algebra: Algebra = tree.algebra
        self.machine: Scalar = tree.algebra.zero  #: extent of the machine, m, to which travels are relative
        self.points = {point.name: point for point in scene.points}
        self.elements = {(element.section, element.name): element for element in scene.elements}
        self.input_numbers = {item.name: number for number, item in enumerate(scene.inputs)}
        self.state_numbers = {item.name: number for number, item in enumerate(scene.states)}
        self.controllers = {item.name: item for item in scene.controllers}
        self._outputs_of_controllers: dict[str, Scalar] = {}
        self.energies: dict[str, Scalar] = {}
        self.recorded: dict[Any, Any] = {}  #: of laws of force elements, by keys of their own
        self.dynamics: Callable[[Symbol], Scalar] = _no_dynamics
        self.reactions: Callable[[Symbol], Scalar] = _no_reactions
        self.section_loads: Callable[[Symbol], Scalar] = _no_section_loads

    def input(self, block: str, index: int = 0) -> Scalar:
        return Scalar(self.algebra.tape, self.algebra.tape.input(block, index))

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return the value on the tape of a symbol in a formula, by the symbol's kind. Raises ModelError for kinds that
        are not available in this context, such as reactions in forces."""
        match symbol.kind:
            case "time":
                return self.input("t")
            case "parameter":
                return self.tree.parameters[symbol.name]
            case "input":
                return self.input("u", self.input_numbers[symbol.name])
            case "state":
                return self.input("z", self.state_numbers[symbol.name])
            case "controller":
                return self.controller(symbol.name)
            case "q" | "v" | "a" as letter:
                return getattr(self.tree.coordinates[symbol.name], letter)[symbol.index]  # type: ignore[no-any-return]
            case "position" | "velocity" | "acceleration" as of_point:
                vector: Vector = getattr(self.kinematics, of_point)(*self.at(self.points[symbol.name]))
                return vector[symbol.index]
            case "angular_velocity" | "angular_acceleration" as of_body:
                vector = getattr(self.kinematics, of_body)(symbol.name)
                return vector[symbol.index]
            case "rotation":
                return rotation_vector(self.algebra, self.kinematics.axes(symbol.name))[symbol.index]
            case "gravity" | "tau":
                return self.dynamics(symbol)
            case "reaction" | "drive_effort":
                return self.reactions(symbol)
            case "section_load":
                return self.section_loads(symbol)
            case kind if kind in self.offered:
                section, offer = self.offered[kind]
                return offer(self, self.elements[section, symbol.name])
            case _:
                return self.energies[symbol.name]

    def work_of(self, joint: str, index: int = 0) -> dict[int, Scalar]:
        """Return the generalized force by velocity component of a unit effort, N m or N, on a joint's coordinate.

        Parameters
        ----------
        joint : str
            Name of the joint.
        index : int, optional
            Component of the joint's velocity; in absolute coordinates, of the joint's coordinates.

        Returns
        -------
        dict
            Scalars by number of the component in v of the model. In joint coordinates one item, 1, or the ratio of a
            joint that follows another joint; in absolute coordinates all that are not zero.

        Raises
        ------
        ModelError
            A joint in absolute coordinates whose coordinates are not plain numbers.
        """
        coordinates = self.tree.coordinates[joint]
        return {coordinates.dofs[index]: coordinates.ratio}

    def beyond(self, joint: str, index: int, law: Scalar, *, turns: bool) -> Scalar:
        """Return the signed distance of a joint's coordinate from a law.

        Parameters
        ----------
        joint : str
            Name of the joint.
        index : int
            Component of the coordinate.
        law : Scalar
            Value of the law, rad or m.
        turns : bool
            Whether the coordinate is an angle, whose distance is taken within half a turn. In absolute coordinates the
            distance of each angle is, for any value.

        Returns
        -------
        Scalar
            Coordinate minus law, rad or m; within half a turn in (-pi, pi].
        """
        past = self.tree.coordinates[joint].q[index] - law
        call = self.algebra.call
        return call(Op.ATAN2, call(Op.SIN, past), call(Op.COS, past)) if turns else past

    def controller(self, name: str) -> Scalar:
        """Return an output of a controller, recorded at the first call.

        Parameters
        ----------
        name : str
            Name of the output as in formulas; KeyError for another name.

        Returns
        -------
        Scalar
            Value of the output's formula on the tape, in the output's unit in the scene; the same at each call.
        """
        if name not in self._outputs_of_controllers:
            with self.algebra.tape.block(f"controller {name}"):
                self._outputs_of_controllers[name] = self.formula(self.controllers[name].output)
        return self._outputs_of_controllers[name]

    def formula(self, formula: Formula) -> Scalar:
        return record(self.algebra, formula, self)

    def vector(self, formulas: Vector | tuple[Formula, Formula, Formula]) -> Vector:
        return self.algebra.vector([self.formula(item) for item in formulas])  # type: ignore[arg-type]  # formulas

    def mount(self, frame: Frame) -> Mount:
        """Return the mount of a frame's body.

        On a beam it is the mount of the station at the frame's origin.

        Parameters
        ----------
        frame : Frame
            A frame on a body.

        Returns
        -------
        Mount
            Pose and velocities of the body.
        """
        return self.tree.mount_at(frame.body, self.vector(frame.position))

    def at(self, point: Point) -> tuple[str, Vector]:
        return point.body, self.vector(point.position)


class DetachedSymbols(Quantities):
    """Parameters, inputs and time of a scene as inputs of another tape, for formulas that are differentiated
    separately."""

    def __init__(self, scene: Quantities, tape: Tape) -> None:
        self.source = scene
        self.algebra = Algebra(tape)

    def __call__(self, symbol: Symbol) -> Scalar:
        value, tape = self.source(symbol), self.algebra.tape
        source = value.tape.symbol(value.ref)
        ref = tape.constant(value.constant or 0.0) if source is None else tape.input(source.block, source.index)
        return Scalar(tape, ref)


def _no_dynamics(symbol: Symbol) -> Scalar:
    """Refuse inverse dynamics if joints have no coordinates."""
    fault = f"{symbol.kind}.{symbol.name} exists in joint coordinates, and this scene has absolute coordinates [E0502]"
    raise ModelError(Problem(f"{symbol.kind}.{symbol.name}", fault, 'coordinates = "joint"'))


def _no_reactions(symbol: Symbol) -> Scalar:
    """Refuse a reaction in a force, because accelerations would depend on themselves."""
    fault = f"{symbol.kind}.{symbol.name} follows from the accelerations, so no force can depend on it [E0503]"
    raise ModelError(fault, "an output, or an event")


def _no_section_loads(symbol: Symbol) -> Scalar:
    """Refuse section loads outside of outputs and events."""
    fault = f"sections of the beam {symbol.name} are known in outputs and events alone [E0504]"
    raise ModelError(fault, "an output")


def input_signal(quantities: Quantities, item: Input) -> Scalar:
    """Return an input as a function of time, formula plus harmonics; the constant 0 if the scene gives none."""
    algebra = quantities.algebra
    value = quantities.formula(item.formula) if item.formula is not None else algebra.zero
    if not item.harmonics:
        return value
    time = Scalar(algebra.tape, algebra.tape.input("t"))
    return value + waves(algebra, Waves(f"input {item.name}", item.harmonics), time)
