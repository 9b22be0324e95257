"""The register of joint and constraint types: each is a chain of elementary motions with further properties.

All that the package knows of a type follows from its row: sizes, group and units of coordinates, limits, initial
states, keys, rows and frames as a constraint, drawing. A new type is a row here and its name in ``JointType``, and in
``ConstraintType`` unless it has no equations. Other distributions add joint types by entry points of the group
``eomgen.joint_types``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, cached_property
from typing import Any, Generic, Literal, TypeVar, get_args

from eomgen.base.data import dataclass
from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.messages import is_legal

JointType = Literal[
    "fixed", "revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free"
]
ConstraintType = Literal[
    "spherical", "revolute", "universal", "cylindrical", "helical", "prismatic", "planar", "fixed", "distance",
    "point_on_line", "orientation", "rolling", "sliding", "formula",
]  # fmt: skip  # a table
MotionKind = Literal["turn", "travel", "screw", "ball", "free"]
#: Axes of a constraint's frame that its rows use in addition to its origin; "any": the body's own axes by default.
Need = Literal["nothing", "z", "x and z", "any"]
#: Names of joint types in other tools.
JOINTS_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("hinge", "pin", "continuous", "rotational", "rotary"), "revolute"),
    **dict.fromkeys(("slider", "slide", "linear", "translational"), "prismatic"),
    **dict.fromkeys(("ball", "ball_and_socket"), "spherical"),
    **dict.fromkeys(("floating", "freeflyer", "6dof"), "free"),
    **dict.fromkeys(("weld", "welded", "rigid"), "fixed"),
    **dict.fromkeys(("cardan", "hooke"), "universal"),
    "screw": "helical",
}
#: Directions of a joint, orthonormal and right-handed.
AXIS, SECOND_AXIS, THIRD_AXIS = range(3)
#: Units of the coordinates that a constraint may drive.
DRIVE_UNITS: Mapping[str, str] = {"angle": "rad", "travel": "m"}
#: Groups of elementary motions whose coordinates are not plain numbers.
GROUPS: Mapping[str, str] = {"ball": "SO3", "free": "SE3"}
#: Keys of an initial state besides the velocity, by group; a fixed joint has none.
_STARTS = {"": (), "R": ("position",), "SO3": ("position", "rotation"), "SE3": ("position", "orientation", "rotation")}


@dataclass(frozen=True)
class ElementaryMotion:
    """An elementary motion in the chain of a joint type.

    Attributes
    ----------
    kind : turn about an axis, travel along one or more, screw, ball (quaternion) or free (quaternion and position)
    axes : directions of the joint, 0 for the axis, 1 and 2 for the second and the third axis
    components : indices in the joint's velocity, one for each column of the motion subspace
    """

    kind: MotionKind
    axes: tuple[int, ...] = ()
    components: tuple[int, ...] = (0,)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the integrals of velocity components, ``rad`` or ``m``, in the order of ``components``; for a screw
        ``rad``."""
        if self.kind == "free":
            return ("rad", "rad", "rad", "m", "m", "m")
        return ("m" if self.kind == "travel" else "rad",) * len(self.components)


def _turn(component: int = 0, axis: int = AXIS) -> ElementaryMotion:
    return ElementaryMotion("turn", (axis,), (component,))


def _travel(component: int = 0, axis: int = AXIS) -> ElementaryMotion:
    return ElementaryMotion("travel", (axis,), (component,))


_BALL, _FREE = ElementaryMotion("ball", (), (0, 1, 2)), ElementaryMotion("free", (), (0, 1, 2, 3, 4, 5))


@dataclass(frozen=True)
class Connection:
    """A type of joint, of constraint, or of both, by the admissible relative motion between two frames.

    Attributes
    ----------
    chain : elementary motions from the parent to the child, travels first; in the velocity, angular components come
        first
    meanings : of coordinates that are plain numbers, if "angle" and "travel" do not distinguish the coordinates
    drive : the coordinate that a constraint of the type may prescribe
    light : hint for a joint that carries no inertia, with ``{}`` for the body
    equations : numbers of holonomic and velocity rows of a constraint that no chain describes
    needs : axes of the two frames used by the rows of such a constraint
    keys : of constraints of this type alone
    rod : whether pictures show a rod between the origins
    """

    name: str
    chain: tuple[ElementaryMotion, ...] = ()
    meanings: tuple[str, ...] = ()
    drive: Literal["", "angle", "travel"] = ""
    light: str = "mass or inertia for the body {}, rotor_inertia, or a fixed joint (of other formats: lock)"
    equations: tuple[int, int] | None = None
    needs: tuple[Need, Need] | None = None
    keys: tuple[str, ...] = ()
    rod: bool = False

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Unit of the integral of each velocity component: rad or m."""
        result = {k: unit for motion in self.chain for k, unit in zip(motion.components, motion.units, strict=True)}
        return tuple(result[k] for k in range(len(result)))

    @property
    def moves(self) -> bool:
        return bool(self.chain)

    @property
    def group(self) -> str:
        """Factor of the configuration space: R, SO3 or SE3; empty for a fixed joint."""
        return next((GROUPS[motion.kind] for motion in self.chain if motion.kind in GROUPS), "R" if self.chain else "")

    @property
    def v_size(self) -> int:
        return len(self.units)

    @property
    def q_size(self) -> int:
        return self.v_size + (self.group in GROUPS.values())

    @property
    def sizes(self) -> tuple[int, int]:
        """Number of coordinates and number of velocity components."""
        return self.q_size, self.v_size

    @cached_property
    def coordinates(self) -> Mapping[str, str]:
        """Unit of each coordinate by meaning, if all are plain numbers: such coordinates may have springs and
        limits."""
        if self.group != "R":
            return {}
        meanings = self.meanings or tuple("angle" if unit == "rad" else "travel" for unit in self.units)
        return dict(zip(meanings, self.units, strict=True))

    @property
    def angles(self) -> int:
        """Number of coordinates that are angles; angles come first."""
        return sum(unit == "rad" for unit in self.coordinates.values())

    @property
    def counted(self) -> tuple[int, ...]:
        """Angles that two frames determine up to whole turns only; the travel of a screw determines its turns."""
        return tuple(k for motion in self.chain if motion.kind == "turn" for k in motion.components)

    @property
    def is_revolute(self) -> bool:
        """Whether the type is one rotation about the axis."""
        return self.chain == (_turn(),)

    @property
    def starts(self) -> tuple[str, ...]:
        """Keys for the initial position."""
        return _STARTS[self.group]

    @property
    def turned_about(self) -> tuple[int, ...]:
        """Directions of the successive elementary rotations, in order."""
        return tuple(motion.axes[0] for motion in self.chain if motion.kind in ("turn", "screw"))

    @property
    def travels(self) -> tuple[int, ...]:
        """Directions of the translations, without screws."""
        return tuple(axis for motion in self.chain if motion.kind == "travel" for axis in motion.axes)

    def has(self, kind: MotionKind) -> bool:
        """Return whether an elementary motion of this kind is in the chain.

        Parameters
        ----------
        kind : str
            ``turn``, ``travel``, ``screw``, ``ball`` or ``free``.

        Returns
        -------
        bool
            Whether the chain has one.
        """
        return any(motion.kind == kind for motion in self.chain)

    @property
    def second_key(self) -> str:
        """Key of the second axis: one that is turned about has to be written, one that is only travelled along may
        be."""
        return "second_axis" if SECOND_AXIS in self.turned_about else "x_axis" if SECOND_AXIS in self.travels else ""

    @property
    def needed(self) -> tuple[str, ...]:
        """Required keys of a joint of this type, other than the axis."""
        return tuple(word.partition("=")[0] for word in self.joint_keys.split() if "=" in word)

    @property
    def joint_keys(self) -> str:
        """Keys of a joint of this type, other than the axis; needed keys with an example."""
        second = self.second_key.replace("second_axis", "second_axis=[0,1,0]")
        return f"{second} pitch=0.01" if self.has("screw") else second

    @property
    def drawn(self) -> tuple[bool, bool]:
        """Whether pictures show a pin along the axis, and whether a rail; for joints with one axis only."""
        along = all(motion.axes == (AXIS,) for motion in self.chain)
        return along and bool(self.turned_about), along and bool(self.travels or self.has("screw"))

    @property
    def rows(self) -> tuple[int, int]:
        """Number of holonomic rows and number of velocity rows of the constraint."""
        return self.equations or (6 - self.v_size, 0)

    @property
    def frame_axes(self) -> tuple[int, int, int]:
        """Axes of a constraint's frames (0 for x) along each direction: z along the axis, but x and y along two turned
        about."""
        return (0, 1, 2) if len(self.turned_about) > 1 else (2, 0, 1)

    @property
    def uses(self) -> tuple[Need, Need]:
        """Axes of the first and the second frame used by the rows of a constraint, which a scene has to write:
        ``z``, ``x and z``, no axis (``"nothing"``) or ``any`` (the whole frame, by default the axes of the body)."""
        if self.needs is not None or not self.chain:
            return self.needs or ("any", "any")
        if self.has("ball"):
            return ("z" if self.travels else "nothing"), "nothing"
        return ("z", "z") if len(self.turned_about) == 1 and not self.has("screw") else ("x and z", "x and z")

    @property
    def constraint_keys(self) -> str:
        """Keys of a constraint other than the frames; needed keys with an example."""
        return " ".join(("drive",) * bool(self.drive) + self.keys + ("pitch=0.01",) * self.has("screw"))


#: Keys of the body that touches a plane, or a surface.
_SURFACE = ("radius", "shape", "semi_axes", "tube_radius", "surface")
#: Types of robot descriptions come first, in their order: hints have this order.
_ROWS = (
    Connection("revolute", (_turn(),), drive="angle"),
    Connection("prismatic", (_travel(),), drive="travel"),
    Connection("fixed"),
    Connection(
        "free",
        (_FREE,),
        light="mass and inertia = [xx, yy, zz] for the body {}, or three prismatic joints for a point mass",
    ),
    Connection(
        "planar",
        (ElementaryMotion("travel", (SECOND_AXIS, THIRD_AXIS), (1, 2)), _turn()),
        meanings=("angle", "x", "y"),
    ),
    Connection("helical", (ElementaryMotion("screw", (AXIS,)),)),
    Connection("cylindrical", (_travel(1), _turn()), drive="travel"),
    Connection("universal", (_turn(), _turn(1, SECOND_AXIS)), meanings=("first angle", "second angle")),
    Connection(
        "spherical",
        (_BALL,),
        light="inertia = [xx, yy, zz] for the body {}, or two revolute joints for what has no size",
    ),
    Connection("distance", equations=(1, 0), needs=("nothing", "nothing"), keys=("length",), rod=True),
    Connection("point_on_line", (_travel(3), _BALL)),
    Connection("orientation", (ElementaryMotion("travel", (AXIS, SECOND_AXIS, THIRD_AXIS), (0, 1, 2)),)),
    Connection("rolling", equations=(1, 2), needs=("z", "z"), keys=_SURFACE),
    Connection("sliding", equations=(1, 0), needs=("z", "z"), keys=_SURFACE),
    Connection("formula", equations=(1, 0), needs=("any", "nothing"), keys=("equation", "velocity_equation", "unit")),
)
Row = TypeVar("Row")


class _JointTypeRows(dict[str, Row], Generic[Row]):
    """Rows of eomgen's own types, which are iterated over, and rows of other distributions' types by name.

    Parameters
    ----------
    rows : mapping
        Row of each of eomgen's own types.
    of_type : callable
        From a type of another distribution to its row; None for a type without a row.
    """

    def __init__(self, rows: Mapping[str, Row], of_type: Callable[[Connection], Row | None]) -> None:
        super().__init__(rows)
        self._of_type = of_type

    def __missing__(self, name: str) -> Row:
        kind = joint_types_of_others().get(name) if name else None
        row = None if kind is None else self._of_type(kind)
        if row is None:
            raise KeyError(name)
        return row

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or (name != "" and name in joint_types_of_others())

    def get(self, name: str, default: Any = None) -> Any:
        """Return the row of a type by its name, also of another distribution; ``default`` for a type without a row."""
        try:
            return self[name]
        except KeyError:
            return default


TYPES: Mapping[str, Connection] = _JointTypeRows({row.name: row for row in _ROWS}, lambda kind: kind)
JOINTS: Mapping[str, Connection] = _JointTypeRows(
    {name: TYPES[name] for name in get_args(JointType)}, lambda kind: kind
)
CONSTRAINTS: Mapping[str, Connection] = {name: TYPES[name] for name in get_args(ConstraintType)}
#: The group of entry points for joint types of other distributions: objects of the class ``Connection``.
GROUP = "eomgen.joint_types"


def is_own(name: str) -> bool:
    """Return whether a type is eomgen's own."""
    return name in _OWN


_OWN = frozenset(row.name for row in _ROWS)


@cache
def joint_types_of_others() -> Mapping[str, Connection]:
    """Return the joint types of installed distributions by name; entry points are looked for if a name is none of
    eomgen's own.

    Raises
    ------
    UsageError
        Naming the distribution of a type that cannot be taken.
    """
    rows: dict[str, Connection] = {}
    for entry in extensions(GROUP):
        row = load_row(entry, Connection)
        if row.name != entry.name:
            raise broken(entry, f"is the joint type {row.name}")
        if row.name in _OWN or row.name in rows:
            raise broken(entry, "is a joint type that there is already")
        fault = fault_of(row)
        if fault:
            raise broken(entry, fault)
        rows[row.name] = row
    return rows


#: Attributes of types that constraints or drives have.
_OF_THE_CORE = ("drive", "equations", "needs", "keys", "rod")


def fault_of(row: Connection) -> str:
    """Return the fault of a joint type of another distribution: its chain has an order that the equations rely on.

    Parameters
    ----------
    row : Connection
        The type.

    Returns
    -------
    str
        The fault, as the end of a sentence; empty for a sound type.
    """
    fields = [name for name in _OF_THE_CORE if getattr(row, name)]
    if not is_legal(row.name):
        return "has a name that is not a word of letters, digits and underscores"
    if fields:
        return f"has {fields[0]}, which only types in eomgen have"
    if not row.chain:
        return "has an empty chain: a joint type has at least one elementary motion"
    return _fault_of_chain(row)


def _fault_of_chain(row: Connection) -> str:
    """Return the fault in the chain of a joint type as the end of a sentence; empty for a sound chain. Checked are the
    numbering of velocity components, angular components first, travels before turns, the directions, and the number of
    meanings of coordinates."""
    components = [k for motion in row.chain for k in motion.components]
    if sorted(components) != list(range(len(components))):
        return f"has the velocity components {components}, and each from 0 to {len(components) - 1} is needed once"
    units = [unit for _, unit in sorted((k, u) for m in row.chain for k, u in zip(m.components, m.units, strict=True))]
    if units != sorted(units, reverse=True):
        return "has a travel before a turn among its velocity components; angular components come first"
    kinds = [motion.kind for motion in row.chain]
    if kinds != sorted(kinds, key=lambda kind: kind != "travel"):
        return "has a travel after a turn in its chain; travels come first"
    if len(kinds) > 1 and {"ball", "free", "screw"} & set(kinds):
        return "has a ball, a free motion or a screw among other motions"
    if row.turned_about not in ((), (AXIS,), (AXIS, SECOND_AXIS)):
        return "has turns about other directions than the axis, and the second axis after that"
    if THIRD_AXIS in row.travels and SECOND_AXIS not in row.travels:
        return "has a travel along the third direction without one along the second"
    if row.group == "R" and len(row.coordinates) != row.v_size:
        return f"has {row.v_size} coordinates and needs as many different meanings"
    return ""


def by_component(angular: str, linear: str) -> dict[str, str | tuple[str, ...]]:
    """Return the units of values per velocity component, by the name of each joint type that moves. ``angular`` is the
    unit for a component in rad/s, ``linear`` for a component in m/s. Types with one elementary motion and equal units
    have a text, other types a tuple with a unit for each component."""

    def units_of(row: Connection) -> str | tuple[str, ...] | None:
        units = tuple(angular if unit == "rad" else linear for unit in row.units)
        return units[0] if units and len(row.chain) == 1 and len(set(units)) == 1 else units or None

    return _by_type(units_of)


def by_coordinate(angular: str, linear: str, free: str = "") -> dict[str, str | tuple[str, ...]]:
    """Return the units of values per coordinate, by joint type, for types whose coordinates are plain numbers, as
    ``by_component`` does; a type with the group SE3 has the unit ``free`` unless that is empty."""
    of_components = by_component(angular, linear)

    def units_of(row: Connection) -> str | tuple[str, ...] | None:
        return of_components[row.name] if row.coordinates else free if free and row.group == "SE3" else None

    return _by_type(units_of)


def _by_type(units_of: Callable[[Connection], str | tuple[str, ...] | None]) -> dict[str, str | tuple[str, ...]]:
    rows = {name: units for name, row in JOINTS.items() if (units := units_of(row)) is not None}
    return _JointTypeRows(rows, units_of)
