"""An axle on a test rig: states of rest over travel, steering and loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import checked_call, names_of
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import log_notes, nearest, shown
from eomgen.compiled.arguments import number_of
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.pipeline.documents import load_scene
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.suspension.curves import Car, Curves, Wheel, curves_of
from eomgen.products.suspension.result import SuspensionCurves
from eomgen.scene.design_poses import DesignPoses, FramePlacement
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.scene import Scene

_PAD = Path(__file__).with_name("pad.toml")
#: Names of the rig's own parameter and constraint, and prefixes of its parts and outputs.
_STEER, _OF_PAD, _LENGTH = "rig_steer", "rig_{}_", "rig_length_{}"


@dataclass(frozen=True)
class Sweep:
    """A quantity of the rig that is varied alone.

    Attributes
    ----------
    name, label, unit : of the curves and of their abscissa
    parameter : of each pad; empty: the travel of the steering joint
    factor : the quantity in SI units by its value in ``unit``
    end : of the range, SI units
    opposite : whether it has the other sign on the right
    """

    name: str
    label: str
    unit: str
    parameter: str
    factor: float
    end: float
    opposite: bool = False


SWEEPS = (
    Sweep("travel", "travel", "mm", "travel", 1e-3, 0.08),
    Sweep("roll", "travel, left up and right down", "mm", "travel", 1e-3, 0.08, opposite=True),
    Sweep("steering", "travel of the steering joint", "mm", "", 1e-3, 0.06),
    Sweep("side force", "force to the left", "kN", "side", 1e3, 3000.0),
    Sweep("braking force", "force backward", "kN", "brake", 1e3, 3000.0),
    Sweep("driving force", "force forward", "kN", "drive", 1e3, 3000.0),
    Sweep("aligning moment", "moment to the left", "N m", "align", 1.0, 100.0),
)

#: Of a steering joint that turns, as the arm of a steering box.
_TURNED: Mapping[str, Any] = {
    "label": "angle of the steering joint",
    "unit": "deg",
    "factor": np.pi / 180.0,
    "end": 0.5,
}


@checked_call('eomgen.suspension("front_axle.toml", ["left_hub", "right_hub"])')
def suspension(
    file: str | PathLike[str],
    hubs: Sequence[str],
    *,
    steering: str = "",
    radius: float | str = 0.3,
    ranges: Mapping[str, float | str] | None = None,
    rows: int = 33,
    other_axle: float | str = 0.0,
    height: float | str = 0.5,
    brake_share: float = 1.0,
    parameters: Mapping[str, float | str] | None = None,
) -> SuspensionCurves:
    """Return kinematics and compliance of an axle, at rest on a rig that holds the body of the car.

    The wheels stand on pads without friction. One quantity at a time varies about the design position: the travel of
    all pads, the same in opposite directions, the steering, and forces and moments at the contacts.

    Parameters
    ----------
    file : path
        Scene file of the axle. Its base is the body of the car, with x forward, y to the left and z up; it has no
        wheels.
    hubs : sequence of str
        Bodies that carry the wheels, with the origin in the centre of the wheel and y along its axis, to the left.
    steering : str
        Joint that steers, of one coordinate, a travel or an angle, which the rig holds or moves; empty for none.
    radius : float
        Distance from the centre of the wheel to the road, m.
    ranges : mapping, optional
        Ends of ranges by name, SI units or texts: ``{"travel": 0.1}`` or ``{"travel": "100 mm"}`` for -0.1 m to 0.1 m.
    rows : int
        States of rest in each range, an odd number, at least 5.
    other_axle : float
        Place of the other axle along x from this one, m: negative in front; 0: supports are not given in percent.
    height : float
        Of the car's centre of mass over the road, m.
    brake_share : float
        Part of this axle in the force of braking; the force of driving is this axle's alone.
    parameters : mapping, optional
        Values in place of the file's parameters, fixed ones as well.

    Returns
    -------
    SuspensionCurves
        Curves of each range, and ``characteristics`` at the design position.

    Raises
    ------
    UsageError
        A wrong argument, and an axle with tyres.
    NumericalError
        The wheels do not reach the pads, or forces do not balance.

    Examples
    --------
    >>> axle = "examples/car/system/front_axle.toml"
    >>> result = eomgen.suspension(axle, ["left_hub", "right_hub"], steering="rack", radius=0.29, rows=5)
    >>> result.curves["travel"].columns["left_hub camber"].round(2)
    array([ 0.87,  0.4 , -0.57, -2.05, -4.08])
    """
    if not isinstance(file, str | PathLike):
        fault = f"the path of a scene file of the axle is needed, not {type(file).__name__} [E2445]"
        raise UsageError(Problem("file", fault, '"front_axle.toml"'))
    scene, hubs = load_scene(file), names_of("hubs", "hubs", hubs, "hub")
    asked, changes = _by_name("ranges", ranges, '"travel": 0.1'), _by_name("parameters", parameters, '"rack_z": 0.2')
    _check_hubs(scene, hubs)
    sweeps = _sweeps(scene, hubs, steering, asked)
    radius, height = _above_zero("radius", radius), _above_zero("height", height)
    car = Car(_number("other_axle", other_axle, "m"), height, _number("brake_share", brake_share, ""))
    if not 0.0 <= car.brake_share <= 1.0:
        raise UsageError(Problem("brake_share", f"{car.brake_share:g} is not a part from 0 to 1 [E2443]", "0.65"))
    if count_of("rows", rows, 5) % 2 != 1:
        fault = f"{rows} is even, and the middle row is the design position [E2446]"
        raise UsageError(Problem("rows", fault, f"{rows + 1}"))
    springs = [spring.name for spring in scene.springs]
    model = _rig(scene.name, Path(file), hubs, springs, steering, radius, changes)
    own = f"parameters.{_OF_PAD.format(hubs[0])}"  # notes of the axle belong to its file
    log_notes(model.name, tuple(note for note in model.notes if note.startswith(own)))
    _, design = _at(model, {})
    sides = {name: -1.0 if design[_OF_PAD.format(name) + "pose"][1] < 0.0 else 1.0 for name in hubs}
    curves: dict[str, Curves] = {}
    for sweep in sweeps:
        values = np.linspace(-1.0, 1.0, rows) * sweep.end
        outputs = _rests(model, sweep, values, sides)
        rolled = []
        if sweep.name == "travel" and len(set(sides.values())) == 2:  # each wheel may move with the other
            rolled = [_rests(model, sweep, values, sides, roll) for roll in (-5e-4, 5e-4)]  # m
        wheels = [_wheel(name, side, outputs, rolled) for name, side in sides.items()]
        lengths = {name: outputs[_LENGTH.format(name)] for name in springs}
        names = sweep.name, sweep.label, sweep.unit
        curves[sweep.name] = curves_of(names, values / sweep.factor, wheels, lengths, car)
    return SuspensionCurves(model.name, curves)


def _number(name: str, value: float | str, unit: str) -> float:
    """Return a finite number in a unit. Raises UsageError."""
    return number_of(name, in_label(name, value, unit) if isinstance(value, str) else value, "number")


def _above_zero(name: str, value: float | str, unit: str = "m", factor: float = 1.0) -> float:
    """Return a number above 0, SI units; texts are in the ``unit``, by ``factor``. Raises UsageError."""
    number = _number(name, value, unit) * (factor if isinstance(value, str) else 1.0)
    if number <= 0.0:
        raise UsageError(
            Problem(name, f"a number above 0 is needed, not {number:g} [E2447]", f"{abs(number) or 0.1:g}")
        )
    return number


def _by_name(argument: str, values: object, example: str) -> dict[str, Any]:
    """Return numbers and texts by name; none if there are none. Raises UsageError for anything else."""
    if values is None:
        return {}
    if not isinstance(values, Mapping) or not all(isinstance(name, str) for name in values):
        fault = f"values by name are needed, not {shown(values)} [E2448]"
        raise UsageError(Problem(argument, fault, f"{argument}={{{example}}}"))
    for name, value in values.items():
        if not isinstance(value, str):
            number_of(f"{argument} {name}", value, "number")
    return dict(values)


def _check_name(name: object, kind: str, known: Sequence[str]) -> None:
    if name not in known:
        hint = nearest(str(name), known)
        raise UsageError(Problem("suspension", f"there is no {kind} {shown(str(name))} [E2444]", hint))


def _check_hubs(scene: Scene, hubs: Sequence[str]) -> None:
    """Raise UsageError for unknown hubs, equal hubs, hubs whose y is not to the left, and an axle with tyres."""
    for name in hubs:
        _check_name(name, "body", [body.name for body in scene.bodies])
    if not hubs or len(set(hubs)) < len(hubs):
        raise UsageError(
            Problem("hubs", "different bodies are needed, one or more [E2449]", '["left_hub", "right_hub"]')
        )
    places = {joint.child: FramePlacement(joint.parent, joint.position, joint.orientation) for joint in scene.joints}
    for name in hubs:
        axis = DesignPoses(places).pose(name).axes[:, 1]
        if axis[1] < 0.5:
            fault = f"y of this hub is the axis of the wheel, and is {axis.round(3).tolist()}, not to the left [E2453]"
            raise UsageError(Problem(f"hubs {name}", fault, "rotation of the joint that carries the hub"))
    wheels = [*scene.parts.get("contacts", ()), *scene.tyres]
    if wheels:
        fault = f"the axle has a tyre, {wheels[0].name}, and the rig has pads under the hubs [E2450]"
        raise UsageError(Problem("suspension", fault, "a file of the axle without wheels, which the car includes"))


def _sweeps(scene: Scene, hubs: Sequence[str], steering: str, ends: Mapping[str, float | str]) -> list[Sweep]:
    """Return the quantities that are varied, up to the ends of the caller. Raises UsageError for a range without the
    part, and for a steering joint that does not have one coordinate."""
    joints = {joint.name: JOINTS[joint.type] for joint in scene.joints}
    for name in ends:
        _check_name(name, "range", [sweep.name for sweep in SWEEPS])
    if steering:
        _check_name(steering, "joint", list(joints))
        if len(joints[steering].coordinates) != 1:
            fault = f"the joint has {len(joints[steering].units)} coordinates, and one is needed [E2451]"
            raise UsageError(Problem(f"steering {steering}", fault, "the joint of the rack or of the pitman arm"))
    lacking = {
        "steering": 'steering="rack"' * (not steering),
        "roll": 'hubs=["left_hub", "right_hub"]' * (len(hubs) < 2),
    }
    for name in ends:
        if hint := lacking.get(name):
            raise UsageError(Problem(f"ranges {name}", f"the range needs {hint.partition('=')[0]} [E2452]", hint))
    turns = bool(steering) and "rad" in joints[steering].units
    rows = [replace(row, **_TURNED) if turns and not row.parameter else row for row in SWEEPS]
    return [
        replace(row, end=_above_zero(f"ranges {row.name}", ends.get(row.name, row.end), row.unit, row.factor))
        for row in rows
        if not lacking.get(row.name)
    ]


def _rig(
    name: str,
    axle: Path,
    hubs: Sequence[str],
    springs: Sequence[str],
    steering: str,
    radius: float,
    parameters: Mapping[str, float | str],
) -> Model:
    """Return the model of an axle on the rig."""
    pad = {"file": str(_PAD), "parameters": {"radius": radius}}
    pads = {f"{hub}_pad": {**pad, "parent": hub, "prefix": _OF_PAD.format(hub)} for hub in hubs}
    rig: dict[str, Any] = {
        "format": 1,
        "name": name,
        "include": {"axle": {"file": str(axle.resolve()), "prefix": "", "parameters": parameters}, **pads},
        "outputs": {_LENGTH.format(spring): {"formula": f"length.{spring}", "unit": "m"} for spring in springs},
    }
    if steering:
        rig["parameters"] = {_STEER: {"value": 0.0, "tunable": True}}
        rig["constraints"] = {_STEER: {"type": "formula", "equation": f"q.{steering} - {_STEER}"}}
    return build_for_run(rig, start="equilibrium")


def _at(model: Model, values: Mapping[str, float], q: Array | None = None) -> tuple[Array, Mapping[str, Array]]:
    """Return configuration and outputs at rest, from a configuration near it."""
    rest = model.equilibrium(initial=None if q is None else {"q": q}, parameters=values)
    still = np.zeros(model.nv)
    return rest.q, model.outputs(rest.q, still, still, z=rest.z, multipliers=rest.multipliers, parameters=values)


def _wheel(name: str, side: float, outputs: Mapping[str, Array], rolled: Sequence[Mapping[str, Array]]) -> Wheel:
    """Return the states of a wheel by outputs of the rig, and by outputs after a small roll to each side, if any."""
    pose, arm, load = (_OF_PAD.format(name) + part for part in ("pose", "arm", "load"))
    contacts = [row[pose][:, :3] + row[arm] for row in rolled]
    return Wheel(name, side, outputs[pose], outputs[arm], outputs[load], contacts[1] - contacts[0] if rolled else None)


def _rests(
    model: Model, sweep: Sweep, values: Array, sides: Mapping[str, float], roll: float = 0.0
) -> dict[str, Array]:
    """Return the outputs (rows, size) at rest over a range, from the middle outwards, with pads on the left that are
    higher by ``roll`` and lower on the right, of the unit of the range. Raises NumericalError."""
    rests: dict[int, Mapping[str, Array]] = {}
    middle = len(values) // 2
    for side in (range(middle, len(values)), range(middle - 1, -1, -1)):
        q = None
        for row in side:
            signs = {name: hand if sweep.opposite else 1.0 for name, hand in sides.items()}
            asked = {
                f"{_OF_PAD.format(name)}{sweep.parameter}": sign * values[row] + sides[name] * roll
                for name, sign in signs.items()
            }
            try:
                q, rests[row] = _at(model, asked if sweep.parameter else {_STEER: values[row]}, q)
            except NumericalError as error:
                place = f"suspension: {sweep.name}, {values[row] / sweep.factor:.4g} {sweep.unit}"
                raise NumericalError(
                    replace(error.problems[0], where=place, hint="a smaller end of the range")
                ) from None
    return {name: np.array([rests[row][name] for row in range(len(values))]) for name in rests[middle]}
