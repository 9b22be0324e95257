"""A machine as numbers: links that joints move, with all fixed bodies; made of a Scene.

Every reader of a description fills the same classes, so that a comparison knows no format.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, fields, replace
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Node, infix
from eomgen.scene.inertia import NOTHING, Inertia, combine_inertias, tensor
from eomgen.scene.joints.model import Joint
from eomgen.symbolic.evaluate import evaluate as evaluate_tape
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene
    from eomgen.system.description import Solid
    from eomgen.system.system import System

#: Fields of force elements, states and controllers that no equation follows from.
_SAID = frozenset({"name", "label", "description", "unit", "place"})


class Placement(NamedTuple):
    """Place of a frame in a second one: axes (3, 3), own to second axes, and origin (3,), m."""

    axes: Array
    origin: Array

    def then(self, placement: Placement) -> Placement:
        """Return the place of a frame that is at ``placement`` in this frame."""
        return Placement(self.axes @ placement.axes, self.axes @ placement.origin + self.origin)

    def inverse(self) -> Placement:
        """Return the place of the second frame in the first."""
        return Placement(self.axes.T, -self.axes.T @ self.origin)

    def point(self, position: Array) -> Array:
        """Return a place of the first frame in the second, m."""
        return np.asarray(self.axes @ position + self.origin)


AT_ORIGIN = Placement(np.eye(3), np.zeros(3))


class MachineBody(NamedTuple):
    """A body of a link: mass properties in the body's frame, the place of this frame in the link, and the name of the
    fixed joint; empty for the body on the link's joint."""

    inertia: Inertia
    place: Placement
    joint: str

    @property
    def in_link(self) -> Inertia:
        """Mass properties in the frame of the link."""
        return self.inertia.transform(*self.place)


@dataclass(frozen=True)
class MachineLink:
    """All bodies that one joint moves together.

    Attributes
    ----------
    joint, type : name and type of the joint
    body : the body that the joint carries
    parent : number of the parent's link, -1 for the base
    pose : of the link's frame, which is the joint's frame, in the parent's with all coordinates at zero
    axis, second_axis : (3,) unit vectors, in the link's frame; None if the type has none
    bodies : each body of the link
    numbers : quantities of the joint by name, SI; a quantity that a reader does not know is absent
    held : whether the coordinates follow another joint, or time, and are not independent
    """

    joint: str
    type: str
    body: str
    parent: int
    pose: Placement
    axis: Array | None
    second_axis: Array | None
    bodies: Mapping[str, MachineBody]
    numbers: Mapping[str, float | str]
    held: bool = False

    @cached_property
    def whole(self) -> Inertia:
        """Mass properties of all bodies together, in the frame of the link."""
        return combine_inertias([body.in_link for body in self.bodies.values()] or [NOTHING])


@dataclass(frozen=True)
class MachineLoop:
    """A constraint between two frames, or an equation.

    Attributes
    ----------
    ends : number of the link, and the frame in the link, of both ends; empty for an equation
    uses : axes of the frames that the equations use: by the words of ``Connection.uses``
    numbers : further quantities, by name
    """

    name: str
    type: str
    ends: Sequence[tuple[int, Placement]]
    uses: tuple[str, str]
    numbers: Mapping[str, float | str]


class MachineMotion(NamedTuple):
    """Coordinates at n states, link by link.

    Attributes
    ----------
    q, v : (n, size) of each link, empty for held ones; quaternions (w, x, y, z) first, twists in the link's axes
    inputs : (n,) of each input
    """

    q: Sequence[Array]
    v: Sequence[Array]
    inputs: Mapping[str, Array]


class Forces(NamedTuple):
    """Terms of the equations of motion at several states, in the order of the links' coordinates.

    Attributes
    ----------
    mass : (n, nv, nv)
    bias : (n, nv) inertial forces; None if the reader gives the sum alone
    force : (n, nv) applied forces, as gravity; None likewise
    total : (n, nv) bias less the applied forces
    """

    mass: Array
    bias: Array | None
    force: Array | None
    total: Array


@dataclass(frozen=True)
class Machine:
    """One description as numbers.

    Attributes
    ----------
    name : of the description, for messages
    gravity : (3,) m/s^2, in the axes of the base
    links : parents before children
    loops : constraints; None if unknown to the reader
    parts : further parts by name: force elements, internal states, controllers, the motion of the base; None
        if unknown to the reader
    inputs : names of inputs
    place : from a key (``bodies.arm.mass``) to ``file:line``
    forces : evaluates the equations of motion
    notes : on parts that the reader left out
    initial : coordinate at the start, of each joint with one coordinate
    solids : of bodies without a place: mass, kg, and principal moments of inertia, (3,) kg m^2
    """

    name: str
    gravity: Array
    links: tuple[MachineLink, ...]
    loops: tuple[MachineLoop, ...] | None
    inputs: tuple[str, ...]
    place: Callable[[str], str]
    forces: Callable[[MachineMotion], Forces]
    parts: Mapping[str, Mapping[str, float | str]] | None = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    initial: Mapping[str, float] = field(default_factory=dict)
    solids: Mapping[str, tuple[float, Array]] = field(default_factory=dict)


class Lumps:
    """Links in the making: bodies are added to the links that carry them, with their mass properties."""

    def __init__(self) -> None:
        #: Number of the link, and the place in the link, of each body.
        self.places: dict[str, tuple[int, Placement]] = {BASE: (-1, AT_ORIGIN), WORLD: (-1, AT_ORIGIN)}
        self.bodies: list[dict[str, MachineBody]] = []
        self._joints: dict[str, str] = {}

    def moved(self, body: str) -> int:
        """Begin a link with a body; return the number of the link."""
        self.places[body] = (len(self.bodies), AT_ORIGIN)
        self.bodies.append({})
        return len(self.bodies) - 1

    def fixed(self, body: str, parent: str, pose: Placement, joint: str = "") -> None:
        """Add a body that a joint, named ``joint``, fixes to the body ``parent`` at a pose in it."""
        number, placement = self.places[parent]
        self._joints[body] = joint
        self.places[body] = (number, placement.then(pose))

    def weigh(self, body: str, inertia: Inertia) -> None:
        """Add the mass properties of a body, in the frame of the body; bodies of the base are left out."""
        number, placement = self.places[body]
        if number >= 0:
            self.bodies[number][body] = MachineBody(inertia, placement, self._joints.get(body, ""))


class _Values:
    """Formulas of a scene as numbers, at the default parameters."""

    def __init__(self, scene: Scene) -> None:
        self.parameters = {item.name: item.value for item in scene.parameters}

    def number(self, formula: Any) -> float | str:
        """Return the value of a formula of parameters, or the text of a formula that has other symbols or no value."""
        if all(symbol.kind == "parameter" for symbol in symbols(formula)):
            try:
                return evaluate(formula, lambda symbol: self.parameters[symbol.name])
            except ArithmeticError:
                pass
        return infix(formula)

    def vector(self, formulas: Sequence[Any]) -> Array:
        return np.array([evaluate(item, lambda symbol: self.parameters[symbol.name]) for item in formulas])

    def flat(self, value: Any, key: str = "") -> dict[str, float | str]:
        """Return the numbers and texts in nested data (formulas, mappings, sequences, dataclasses) by dotted keys below
        ``key``."""
        if isinstance(value, Node):
            return {key: self.number(value)}
        if value is None or isinstance(value, str):
            return {key: value or ""}
        if isinstance(value, bool | int | float):
            return {key: float(value)}
        result: dict[str, float | str] = {}
        if isinstance(value, Mapping):
            items = [(str(name), item) for name, item in value.items()]
        elif isinstance(value, np.ndarray | tuple | list):
            items = [(str(number), item) for number, item in enumerate(value)]
        else:
            names = [item.name for item in fields(value) if item.name not in _SAID]
            items = [(name, getattr(value, name)) for name in names]
        for name, item in items:
            result |= self.flat(item, f"{key}.{name}" if key else name)
        return result


def of_scene(scene: Scene, system: System, file: str = "") -> Machine:
    """Return a Scene as numbers.

    Parameters
    ----------
    system : System
        With ``mass``, ``coupling``, ``force`` and, of a moving base, ``base_motion``.
    file : str
        Name of the file: of the machine in messages, and the place of keys without a line.
    """
    values, lumps = _Values(scene), Lumps()
    carried: list[tuple[Joint, int, Placement]] = []
    for joint in scene.joints:
        pose = Placement(np.array(joint.orientation), values.vector(joint.position))
        if joint.kind.moves:
            parent, placement = lumps.places[joint.parent]
            lumps.moved(joint.child)
            carried.append((joint, parent, placement.then(pose)))
        else:
            lumps.fixed(joint.child, joint.parent, pose, joint.name)
    for body in scene.bodies:
        (mass,), entries = values.vector([body.mass]), values.vector(body.inertia).tolist()
        lumps.weigh(body.name, Inertia(mass, values.vector(body.center_of_mass), tensor(entries)))
    links = tuple(
        _link(joint, parent, pose, lumps, number, values) for number, (joint, parent, pose) in enumerate(carried)
    )
    return Machine(
        file or scene.name,
        values.vector(scene.gravity),
        links,
        tuple(_loop(item, lumps, values) for item in scene.constraints),
        tuple(item.name for item in scene.inputs),
        lambda key: _place(scene.source, key) or file,
        partial(_forces, system, links),
        _parts(scene, values),
        scene.notes,
        {joint.name: joint.initial_position[0] for joint in scene.joints if len(joint.initial_position) == 1},
    )


def of_equations(name: str, system: System, links: Sequence[MachineLink], solids: Sequence[Solid] = ()) -> Machine:
    """Return equations without bodies, as of SymPy, as a machine with the links of another one.

    Parameters
    ----------
    name, system : name of the equations for messages, and their functions
    links : of the machine with the same coordinates, named as the joints, or ``q_`` and the joint
    solids : bodies by name, of which mass and principal moments of inertia are compared

    Raises
    ------
    UsageError
        A coordinate without a counterpart.
    """
    coordinates = {factor.name for factor in system.factors}
    moving = [link for link in links if not link.held]
    names = {
        link.joint: next((item for item in (link.joint, f"q_{link.joint}") if item in coordinates), "")
        for link in moving
    }
    if "" in names.values() or len(coordinates) != len(names):
        fault = f"the coordinates of {name} are {', '.join(sorted(coordinates))} [E0566]"
        hint = f"coordinates named as the joints: {', '.join(names)}"
        raise UsageError(Problem("coordinates", fault, hint))
    renamed = [replace(link, joint=names.get(link.joint, link.joint)) for link in links]
    inputs = tuple(item.name for item in system.inputs)

    def total(motion: MachineMotion) -> Forces:
        return _forces(system, renamed, motion)._replace(bias=None, force=None)

    mass_properties: dict[str, tuple[float, Array]] = {}
    for solid in solids:
        mass, *entries = (evaluate(item, lambda symbol: 0.0) for item in (solid.mass, *solid.inertia))
        mass_properties[solid.name] = mass, np.linalg.eigvalsh(tensor(entries)).astype(float)
    return Machine(name, np.zeros(3), tuple(links), (), inputs, lambda _: "", total, None, solids=mass_properties)


def _link(joint: Joint, parent: int, pose: Placement, lumps: Lumps, number: int, values: _Values) -> MachineLink:
    """Return the link that a joint moves, from its parent's number and its pose in the parent; ``number`` is the link's
    in ``lumps``, which has its bodies."""
    kind = joint.kind
    axis = np.array(joint.axis) if kind.turned_about or kind.travels else None
    second = np.array(joint.second_axis) if kind.second_key else None
    return MachineLink(
        joint.name,
        joint.type,
        joint.child,
        parent,
        pose,
        axis,
        second,
        lumps.bodies[number],
        dict(_joint_numbers(joint, values)),
        held=joint.mimic is not None or bool(joint.drive),
    )


def _joint_numbers(joint: Joint, values: _Values) -> dict[str, float | str]:
    """Return the quantities of a joint by name: spring, damper, rotor inertia, friction, limits, pitch, mimic and
    drive; formulas that are not constant as texts."""
    result: dict[str, float | str] = {"pitch": values.number(joint.pitch)} if joint.kind.has("screw") else {}
    if joint.kind.coordinates:
        for name in ("stiffness", "damping", "rest", "rotor_inertia"):
            for index, formula in enumerate(joint.each(getattr(joint, name))):
                result[_indexed(name, index, joint)] = values.number(formula)
        for index in range(joint.kind.v_size):
            if result[_indexed("stiffness", index, joint)] == 0.0:
                result[_indexed("rest", index, joint)] = 0.0  # no force follows from the rest of a spring that is none
            ends = {"coulomb": 0.0, "lower": -np.inf, "upper": np.inf}
            result |= {_indexed(name, index, joint): end for name, end in ends.items()}
    for friction in joint.friction:
        result[_indexed("coulomb", friction.index, joint)] = values.number(friction.coulomb)
    for stop in joint.stops:
        for name, end in (("lower", stop.lower), ("upper", stop.upper)):
            if end is not None:
                result[_indexed(name, stop.index, joint)] = values.number(end)
    result["mimic"] = joint.mimic.joint if joint.mimic is not None else ""
    if joint.mimic is not None:
        result |= {"multiplier": values.number(joint.mimic.multiplier), "offset": values.number(joint.mimic.offset)}
    result |= {f"drive.{index}": values.number(item) for index, item in enumerate(joint.drive)}
    return result


def _indexed(name: str, index: int, joint: Joint) -> str:
    return name if joint.kind.v_size == 1 else f"{name}[{index}]"


def _loop(item: Any, lumps: Lumps, values: _Values) -> MachineLoop:
    """Return a constraint of a scene, with its frames on links and its quantities."""
    ends = []
    for frame in item.frames:
        number, placement = lumps.places[frame.body]
        inner = Placement(np.array(frame.orientation), values.vector(frame.position))
        ends.append((number, placement.then(inner)))
    names = ["drive", "length", "radius", "pitch", "shape", "semi_axes", "tube_radius"]
    numbers = values.flat({name: getattr(item, name) for name in (*names, "surface", "equation", "at_velocity")})
    return MachineLoop(item.name, item.type, ends, item.kind.uses, numbers)


def _parts(scene: Scene, values: _Values) -> dict[str, dict[str, float | str]]:
    """Return the further parts of a scene, by ``section.name``, as flat numbers and texts: force elements, states,
    controllers, points that they mention, and the base."""
    result = {f"{element.section}.{element.name}": values.flat(element) for element in scene.elements}
    for section in ("states", "controllers"):
        result |= {f"{section}.{item.name}": values.flat(item) for item in getattr(scene, section)}
    mentioned = {value for part in result.values() for value in part.values() if isinstance(value, str)}
    result |= {f"points.{item.name}": values.flat(item) for item in scene.points if item.name in mentioned}
    if scene.base is not None:
        result["base"] = values.flat(scene.base)
    return result


def _place(source: Mapping[str, str], key: str) -> str:
    """Return ``file:line`` of a key, or of the nearest enclosing key; empty if none is known."""
    parts = key.split(".")
    keys = [".".join(parts[:count]) for count in range(len(parts), 0, -1)]
    if parts[0] == "states":  # one that a controller makes has the name of the controller and a _ first
        words = parts[1].split("_")
        keys += [f"controllers.{'_'.join(words[:count])}" for count in range(len(words) - 1, 0, -1)]
    return next((source[name] for name in keys if name in source), "")


def _forces(system: System, links: Sequence[MachineLink], motion: MachineMotion) -> Forces:
    """Return inertia matrix and forces of a system at the states of a motion, in the order of the links' coordinates;
    parameters and internal states have their defaults, and terms that the system does not have are zero."""
    factors = {factor.name: factor for factor in system.factors}
    count, size = next((len(q) for q in motion.q), 1), len(system.initial_v)
    blocks: dict[str, Array] = {
        "q": np.tile(system.initial_q, (count, 1)),
        "v": np.zeros((count, size)),
        "p": np.array([item.value for item in system.parameters]),
        "z": np.array([item.value for item in system.states]),
        "t": np.zeros(1),
        "u": np.zeros((count, len(system.inputs))),
    }
    columns = np.zeros(0, int)
    for link, q, v in zip(links, motion.q, motion.v, strict=True):
        if not link.held:
            factor = factors[link.joint]
            blocks["q"][:, factor.q], blocks["v"][:, factor.v] = q, v
            columns = np.append(columns, np.arange(factor.v.start, factor.v.stop))
    for number, item in enumerate(system.inputs):
        blocks["u"][:, number] = motion.inputs.get(item.name, 0.0)

    def values(name: str, width: int = size) -> Array:
        if name not in system.functions:
            return np.zeros((count, width))
        function = system.functions[name]
        table = evaluate_tape(system.tape, function.refs, {block: blocks[block] for block in function.inputs})
        return np.broadcast_to(table, (count, table.shape[-1]))

    blocks["base"] = values("base")
    mass = values("mass", size * size).reshape(-1, size, size)[:, columns[:, np.newaxis], columns]
    bias = values("coupling")[:, columns] + values("base_motion")[:, columns]
    force = values("force")[:, columns]
    return Forces(mass, bias, force, bias - force)
