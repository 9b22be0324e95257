"""Scopes of formulas: permitted names and kinds of quantities, and hints for names, functions and signs of other
languages."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.messages import close_names, is_legal, nearest, shown
from eomgen.formula.curves import AnyCurve
from eomgen.formula.nodes import Formula, Symbol

#: Words before the name of a curve, and the order of the derivative for each word.
DERIVATIVES: Mapping[str, int] = {"derivative": 1, "second_derivative": 2}
#: Kinds of quantities of every scene, and the kind of entry with such a quantity.
QUANTITIES: Mapping[str, str] = {
    **dict.fromkeys(("q", "v", "a"), "joint"),
    **dict.fromkeys(("position", "velocity", "acceleration"), "point"),
    **dict.fromkeys(("rotation", "angular_velocity", "angular_acceleration"), "body"),
    "energy": "energy",
    "reaction": "reaction",
    "drive_effort": "drive",
    **dict.fromkeys(("gravity", "tau"), "joint"),
}
#: Sections whose entries have a reaction, in the order of the search for a name.
REACTING = ("reactions", "joints", "constraints")
#: Sections whose entries may be driven.
DRIVEN = ("joints", "constraints")
#: Quantities of force elements that are forces.
_FORCES = ("tension", "load")
#: Parts of a reaction, and the index of the first of three components: angular first.
REACTION_PARTS: Mapping[str, int] = {"moment": 0, "force": 3}
ENERGIES = ("kinetic", "potential", "total", "base_power", "power")


@dataclass(frozen=True, eq=False)  # scopes are compared by identity
class Scope:
    """Which kinds of symbols a formula may use; ``power`` stands for the powers among the energies.

    Attributes
    ----------
    reasons : for kinds excluded for a special reason: kind, reason and hint
    names : further names with a meaning in this scope: the kind of symbol, the meaning, and the symbol
    """

    description: str
    kinds: frozenset[str]
    reasons: tuple[tuple[str, str, str], ...] = ()
    names: Mapping[str, tuple[str, str, Symbol]] = field(default_factory=dict)


_STATE = frozenset((
    "parameter", "time", "curve", "input", "state", "controller", "q", "v", "position", "velocity", "rotation",
    "angular_velocity", "energy", "element", "external", "mode", "gravity",
))  # fmt: skip  # a table
FIXED_PARAMETERS = Scope("fixed parameters", frozenset({"fixed"}))
PARAMETERS = Scope("parameters", frozenset({"parameter"}))
#: The name of the place along a beam, from 0 to 1.
PLACE = "s"
#: The name of the place at which a load acts, in a quantity of a point: ``velocity.here[0]``.
HERE = "here"
#: Quantities of the place at which a load acts, with 3 components each.
LOCAL = ("position", "velocity", "rotation", "angular_velocity")
#: The name of the Gaussian process that a translation makes another of.
GAUSSIAN = "g"
TRANSLATION = Scope(f"{GAUSSIAN}, parameters and curves", frozenset({"parameter", "curve", "gaussian"}))
TIME = Scope("time, parameters and curves", frozenset({"parameter", "time", "curve"}))
_FORCES_INSTEAD = "an effort or a force that depends on it"
_NO_LAWS = ("external", "two exact derivatives are needed, and laws of files do not have these", _FORCES_INSTEAD)
#: Of drives and lengths over time.
MOTION = Scope(
    TIME.description,
    TIME.kinds,
    (
        (
            "input",
            "a motion needs the derivatives of its law, and derivatives of inputs are not known",
            "motion = true in the input, whose caller then gives rate and acceleration, too; or a curve at t",
        ),
        _NO_LAWS,
    ),
)
#: Of accelerations, which are integrated over time when a scene is read.
ACCELERATION = Scope(
    TIME.description,
    TIME.kinds,
    (
        (
            "input",
            "an acceleration is integrated when the scene is read, and values of inputs are known during a run alone",
            "a curve at t, as a table in [curves]; or position by an input with motion = true, whose caller gives"
            " position, rate and acceleration",
        ),
        ("external", "the integral of a law of a file is not known", "a curve at t through values of the law"),
    ),
)
#: Names of the coordinates of a constraint's second frame in the first frame.
IN_FRAME = ("x", "y", "z")
_NOT_IN_CONSTRAINTS = (
    _NO_LAWS,
    *(
        (kind, f"a constraint needs two derivatives of its equation, and {owner} are not known", _FORCES_INSTEAD)
        for kind, owner in (("state", "the second ones of states"), ("controller", "the second ones of controllers"))
    ),
    ("mode", "positions and velocities cannot jump as modes do", _FORCES_INSTEAD),
    (
        "input",
        "a constraint needs two derivatives of its equation, and derivatives of inputs are not known",
        "motion = true in the input, whose caller then gives rate and acceleration, too; or a curve at t",
    ),
)
_VELOCITIES_ELSEWHERE = tuple(
    (kind, "an equation holds positions alone", "velocity_equation = ... in place of equation, linear in velocities")
    for kind in ("v", "velocity")
)
#: Of constraints by formulas, of positions and of velocities, and between two frames.
POSITIONS = Scope(
    "time, parameters, curves, coordinates of joints and positions of points",
    TIME.kinds | {"q", "position"},
    (*_NOT_IN_CONSTRAINTS, *_VELOCITIES_ELSEWHERE),
)
VELOCITIES = Scope(
    "time, parameters, curves, coordinates and velocities of joints, positions and velocities of points",
    POSITIONS.kinds | {"v", "velocity"},
    _NOT_IN_CONSTRAINTS,
)
BETWEEN_FRAMES = Scope(
    f"{', '.join(IN_FRAME)} (the second frame's origin in the first frame), time, parameters and curves",
    TIME.kinds | {"frame"},
    (
        *_NOT_IN_CONSTRAINTS,
        *_VELOCITIES_ELSEWHERE,
        *(
            (kind, "an equation between two frames depends on them alone", "an equation without first and second")
            for kind in ("q", "position")
        ),
    ),
)
#: Of heights of surfaces of constraints.
SURFACE = Scope(
    BETWEEN_FRAMES.description,
    BETWEEN_FRAMES.kinds,
    (
        *_NOT_IN_CONSTRAINTS,
        *(
            (kind, "the height of a surface depends on x and y", "a moving body in first, which carries the surface")
            for kind in ("q", "position", "v", "velocity")
        ),
    ),
)
SPRING_FORCE = Scope("time, parameters, inputs, states, positions, velocities (no accelerations or tensions)", _STATE)
STATE = Scope(
    "time, parameters, inputs, states, positions, velocities and tensions (not accelerations)", _STATE | {"tension"}
)
LOAD = Scope(
    "time, parameters, inputs, states, positions, velocities, tensions and inverse dynamics (not accelerations)",
    _STATE | {"tension", "tau"},
)
#: Of loads that act at a place of a body.
LOCAL_LOAD = Scope(
    f"time, parameters, inputs, states, positions, velocities, tensions, inverse dynamics, and {', '.join(LOCAL)} of"
    f" {HERE} (not accelerations)",
    LOAD.kinds | {"local"},
)
#: Scopes of values that may vary along a beam, by the scope of the same value elsewhere.
ALONG_A_BEAM: Mapping[Scope, Scope] = {
    scope: Scope(
        f"{scope.description}, {PLACE} from 0 to 1 along the beam, and curves of it", scope.kinds | {"place", "curve"}
    )
    for scope in (PARAMETERS, FIXED_PARAMETERS, LOCAL_LOAD)
}
EVERYTHING = Scope(
    "any quantity", LOAD.kinds | {"a", "acceleration", "angular_acceleration", "power", "reaction", "drive_effort"}
)
#: Scope of named expressions before their use in a formula, which may be any formula.
ANYWHERE = Scope(EVERYTHING.description, EVERYTHING.kinds | {"local"})
ANYWHERE_ALONG_A_BEAM = Scope(EVERYTHING.description, ANYWHERE.kinds | {"place"})


@dataclass(frozen=True)
class ElementQuantity:
    """A kind of quantity that force elements of a section offer to formulas: the scope that allows the use, and the
    names of the elements; ``remedy`` if other elements there do not have the quantity."""

    section: str
    scope: str
    names: tuple[str, ...]
    remedy: str = ""


@dataclass(frozen=True)
class Laws:
    """Formulas of time named by a section's entries; in scopes with inputs the names stand for inputs. ``noun`` is the
    word for an entry in messages."""

    noun: str
    formulas: Mapping[str, Formula]


@dataclass(frozen=True)
class SceneNames:
    """The names that formulas of one scene may mention.

    Attributes
    ----------
    parameters : mapping from name to whether the parameter is tunable.
    joints : mapping from name to joint type; an empty type if unknown.
    beams : mapping from name to number of elastic coordinates; 0 if unknown.
    exact_beams : beams that are geometrically exact, and have no elastic coordinates.
    reactions : names in [reactions]; every joint and constraint has a reaction in addition.
    curves : mapping from name to curve.
    curve_arguments : units in SI of the arguments of curves, for curves with known units.
    labels : units of parameters, inputs, states, curves and definitions, as labelled.
    motions : formulas of time of the inputs that are motions.
    laws : by section of a product, formulas of time of its entries.
    entries : by section, objects of entries by name, for words of the register of formula words.
    offered : mapping from kind of quantity to the elements with this quantity.
    definitions : mapping from name to the ``NamedExpression``.
    """

    parameters: Mapping[str, bool] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    motions: Mapping[str, Formula] = field(default_factory=dict)
    laws: Mapping[str, Laws] = field(default_factory=dict)
    states: Collection[str] = ()
    controllers: tuple[str, ...] = ()
    joints: Mapping[str, str] = field(default_factory=dict)
    beams: Mapping[str, int] = field(default_factory=dict)
    exact_beams: tuple[str, ...] = ()
    constraints: tuple[str, ...] = ()
    reactions: tuple[str, ...] = ()
    bodies: Collection[str] = ()
    points: Collection[str] = ()
    modes: tuple[str, ...] = ()
    references: tuple[str, ...] = ()
    curves: Mapping[str, AnyCurve] = field(default_factory=dict)
    curve_arguments: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    entries: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    definitions: Mapping[str, Any] = field(default_factory=dict)
    offered: Mapping[str, ElementQuantity] = field(default_factory=dict)

    def fault_of_reaction(self, name: str) -> tuple[str, str] | None:
        """Return the fault of the name of a reaction, and a hint; None if [reactions], or exactly one of joints and
        constraints, has the name."""
        known = [*self.reactions, *self.joints, *self.constraints]
        if name not in known:
            for kind in _FORCES:
                if (row := self.offered.get(kind)) and name in row.names:
                    fault = f"{name[:64]} is in [{row.section}], and no joint, constraint or reaction [E1879]"
                    return fault, f"{kind}.{name[:64]} in a formula, its force in N"
            return f"there is no joint, constraint or reaction {shown(name)} [E1877]", nearest(name, known)
        if name not in self.reactions and name in self.joints and name in self.constraints:
            hint = f'[reactions] and {name[:64]}_load = {{ joint = "{name[:64]}" }}'
            return f"both a joint and a constraint are called {name[:64]} [E1878]", hint
        return None

    def section_of(self, kind: str) -> str:
        """Return the section of the scene whose entries a kind of symbol names; empty for time, places, local
        quantities, energies, and the process in a translation."""
        if kind in self.offered:
            return self.offered[kind].section
        word = QUANTITIES.get(kind, kind)
        if word in self.laws:
            return word
        if word == "body":
            return "bodies"
        return "" if word in ("time", "place", "local", "energy", "gaussian") else f"{word}s"


_STEP = "1 if t > 1 else 0"
_LIMITS = "min(max(x, low), high)"
_TABLE = "a curve through points: [curves.NAME], and NAME(x)"
#: Of functions that jump periodically.
_PERIODIC = 'a curve with outside = "periodic", or an input with a wave, whose jumps have known times'
_RATE = "v.joint of a coordinate, or derivative.curve(t) of a curve"
#: Functions of other languages, with the expression for each.
_FUNCTIONS: Mapping[str, str] = {
    **dict.fromkeys(("step", "heaviside", "unit_step"), _STEP),
    **dict.fromkeys(("where", "ifelse", "iif", "select"), "a if x > 0 else b"),
    **dict.fromkeys(("saturate", "saturation", "sat", "clip", "clamp", "limit"), _LIMITS),
    **dict.fromkeys(("integral", "integrate", "integ"), 'a state of its own: [states] and NAME = { rate = "..." }'),
    **dict.fromkeys(("der", "diff", "ddt", "dt", "gradient"), _RATE),
    **dict.fromkeys(("delay", "lag"), "a sampled state: [states.NAME] with sample, formula and delay"),
    **dict.fromkeys(("interp", "interp1", "lookup", "table", "spline"), _TABLE),
    **dict.fromkeys(("random", "rand", "randn", "noise"), "an input with a table of random numbers, or a road"),
    **dict.fromkeys(("mod", "fmod", "rem", "remainder", "floor", "ceil", "round", "int"), _PERIODIC),
    **dict.fromkeys(("sgn", "signum"), "sign"),
    **dict.fromkeys(("ln",), "log"),
    **dict.fromkeys(("log10", "log2"), "log(x) / log(10), where log is the natural logarithm"),
    **dict.fromkeys(("pow", "power"), "x ** y"),
    **dict.fromkeys(("square", "sqr"), "x ** 2"),
    **dict.fromkeys(("fabs",), "abs"),
    **dict.fromkeys(("norm", "hypot", "magnitude"), "sqrt(x**2 + y**2 + z**2), with the components of the vector"),
    **{f"arc{name}": f"a{name}" for name in ("sin", "cos", "tan", "tan2")},
    **{f"{name}d": f"{name}(x * pi / 180): angles are in radians" for name in ("sin", "cos", "tan")},
}
#: Kinds of quantities by other names.
_KINDS: Mapping[str, str] = {
    **dict.fromkeys(("qd", "qdot", "dq", "q_dot", "qvel", "omega", "w", "speed", "rate", "dot"), "v"),
    **dict.fromkeys(("qdd", "ddq", "qddot", "q_ddot", "qacc", "alpha", "vdot"), "a"),
    **dict.fromkeys(("qpos", "angle", "theta", "phi", "joint"), "q"),
    **dict.fromkeys(("pos", "point", "x", "p", "r"), "position"),
    "vel": "velocity",
    "acc": "acceleration",
}
_AXES = "xyz"


def function_hint(name: str, curves: Iterable[str], functions: Iterable[str]) -> str:
    """Return the remedy for a call of ``name``, a function that formulas do not have: an expression in formulas, or the
    nearest name of a curve or function."""
    known = [*curves, *functions]
    return name.lower() if name.lower() in known else _FUNCTIONS.get(name.lower()) or nearest(name, known)


def kind_hint(kind: str, name: str, names: SceneNames, kinds: Iterable[str]) -> str:
    """Return a hint for ``kind.name`` if no quantity has this kind: both words exchanged, another name of the kind, or
    the nearest of ``kinds``."""
    every = list(kinds)
    if name in every and (kind in names.joints or kind in names.beams or kind in names.points):
        return f"{name}.{kind}"
    if kind in ("effort", "torque", "force") and is_legal(name):
        return f"drive_effort.{name[:64]} of a driven joint; of an entry of [efforts] its own formula, written again"
    swapped = _KINDS.get(name, "")
    if swapped and (kind in names.joints or kind in names.points):
        return f"{swapped}.{kind}"
    return f"{_KINDS[kind]}.{name[:64]}" if kind in _KINDS and is_legal(name) else nearest(kind, every)


def name_hint(name: str, names: SceneNames, scope: Scope, known: Iterable[str]) -> str:
    """Return a hint for a name that does not exist: a meaning of the name in the scope, or the nearest of ``known``."""
    every = list(known)
    if name.lower() in ("time", "seconds"):
        return "t"
    if name.lower() in IN_FRAME and "frame" in scope.kinds:
        return name.lower()
    if name in IN_FRAME and scope in (POSITIONS, VELOCITIES):
        return "first and second: x, y and z are coordinates of the second frame's origin in the first frame"
    if name in ("g", "gravity"):
        return f'9.81, or a parameter: {name} = {{ value = 9.81, unit = "m/s^2" }}'
    if name in names.points and "position" in scope.kinds:
        return f"position.{name}[0]"
    joined = re.fullmatch(r"([A-Za-z]+)_(\w+)", name)
    if joined and joined[2] in names.joints:
        return f"{_KINDS.get(joined[1], joined[1] if joined[1] in ('q', 'v', 'a') else 'q')}.{joined[2]}"
    hint = nearest(name, every)
    moving = next(iter(names.joints), "")
    if moving and "q" in scope.kinds and not close_names(name, every):
        return f"q.{moving} or v.{moving}, a coordinate or a velocity, or {hint}"
    return hint


def parts_hint(names: SceneNames, word: str, part: str) -> str:
    """Return a hint for parts such as ``position.tip.x`` and ``q[0]``, which formulas do not have: ``word`` stands
    before ``part``; empty without a hint."""
    if part and part in _AXES and word:
        return f"{word}[{_AXES.index(part)}]"
    if word in names.points:
        return f"position.{word}[{part or 0}]"
    moving = next(iter(names.joints), "joint")
    return f"{word}.{moving}" if word in ("q", "v", "a") else ""
