"""An axle on a test rig: states of rest over travel, steering and loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, names_of
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import nearest, shown
from eomgen.compiled.arguments import number_of
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.pipeline.documents import load_scene
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.suspension.curves import Car, Curves, Wheel, curves_of
from eomgen.products.suspension.result import SuspensionCurves
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


@checked_call('eomgen.suspension("front_axle.toml", ["left_hub", "right_hub"])')
def suspension(
    file: str | Path,
    hubs: Sequence[str],
    *,
    steering: str = "",
    radius: float = 0.3,
    ranges: Mapping[str, float] | None = None,
    rows: int = 33,
    other_axle: float = 0.0,
    height: float = 0.5,
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
        Joint that steers, of one coordinate, which the rig holds or moves; empty for none.
    radius : float
        Distance from the centre of the wheel to the road, m.
    ranges : mapping, optional
        Ends of ranges by name, in SI units: ``{"travel": 0.1}`` for -0.1 m to 0.1 m.
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
        No such hub, joint or range, or a number of rows or a length that does not do.
    NumericalError
        The wheels do not reach the pads, or forces do not balance.

    Examples
    --------
    >>> axle = "examples/car/system/front_axle.toml"
    >>> result = eomgen.suspension(axle, ["left_hub", "right_hub"], steering="rack", radius=0.29, rows=5)
    >>> result.curves["travel"].columns["left_hub camber"].round(2)
    array([ 0.87,  0.4 , -0.57, -2.05, -4.08])
    """
    asked, scene = dict(ranges or {}), load_scene(file)
    hubs = names_of("hubs", "hubs", hubs, "hub")
    _check_names(scene, hubs, steering, asked)
    above_zero = {"radius": radius, "height": height, **asked}
    for name, value in (above_zero | {"rows": rows, "other_axle": other_axle, "brake_share": brake_share}).items():
        number_of(name, value, "number")
    wrong = not hubs or len(set(hubs)) < len(hubs) or rows < 5 or rows % 2 != 1 or min(above_zero.values()) <= 0.0
    if wrong or not 0.0 <= brake_share <= 1.0:
        fault = "hubs are different ones, rows are odd and at least 5, radius, height and ranges are above 0, "
        fault += "brake_share is 0 to 1 [E2443]"
        raise UsageError(Problem("suspension", fault, 'hubs=["left_hub", "right_hub"], rows=33'))
    springs = [spring.name for spring in scene.springs]
    model = _rig(scene.name, Path(file), hubs, springs, steering, radius, dict(parameters or {}))
    _, design = _at(model, {})
    sides = {name: -1.0 if design[_OF_PAD.format(name) + "pose"][1] < 0.0 else 1.0 for name in hubs}
    car = Car(other_axle, height, brake_share)
    curves: dict[str, Curves] = {}
    for sweep in SWEEPS:
        if not sweep.parameter and not steering:
            continue
        values = np.linspace(-1.0, 1.0, rows) * asked.get(sweep.name, sweep.end)
        outputs = _rests(model, sweep, values, sides)
        wheels = [
            Wheel(name, side, *(outputs[_OF_PAD.format(name) + part] for part in ("pose", "arm", "load")))
            for name, side in sides.items()
        ]
        lengths = {name: outputs[_LENGTH.format(name)] for name in springs}
        names = sweep.name, sweep.label, sweep.unit
        curves[sweep.name] = curves_of(names, values / sweep.factor, wheels, lengths, car)
    return SuspensionCurves(model.name, curves)


def _check_names(scene: Scene, hubs: Sequence[str], steering: str, ranges: Mapping[str, float]) -> None:
    """Raise UsageError for a name of a body, a joint or a range that there is not."""
    bodies, joints = [body.name for body in scene.bodies], [joint.name for joint in scene.joints]
    names = [(name, "range", [sweep.name for sweep in SWEEPS]) for name in ranges]
    names += [(name, "body", bodies) for name in hubs] + ([(steering, "joint", joints)] if steering else [])
    for name, kind, known in names:
        if name not in known:
            hint = nearest(name, known) or f"one of {', '.join(known[:8])}"
            raise UsageError(Problem("suspension", f"there is no {kind} {shown(name)} [E2444]", hint))


def _rig(
    name: str,
    axle: Path,
    hubs: Sequence[str],
    springs: Sequence[str],
    steering: str,
    radius: float,
    parameters: dict[str, float | str],
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


def _rests(model: Model, sweep: Sweep, values: Array, sides: Mapping[str, float]) -> dict[str, Array]:
    """Return the outputs (rows, size) at rest over a range, from the middle outwards. Raises NumericalError."""
    rests: dict[int, Mapping[str, Array]] = {}
    middle = len(values) // 2
    for side in (range(middle, len(values)), range(middle - 1, -1, -1)):
        q = None
        for row in side:
            signs = {name: hand if sweep.opposite else 1.0 for name, hand in sides.items()}
            asked = {f"{_OF_PAD.format(name)}{sweep.parameter}": sign * values[row] for name, sign in signs.items()}
            try:
                q, rests[row] = _at(model, asked if sweep.parameter else {_STEER: values[row]}, q)
            except NumericalError as error:
                place = f"suspension: {sweep.name}, {values[row] / sweep.factor:.4g} {sweep.unit}"
                raise NumericalError(
                    replace(error.problems[0], where=place, hint="a smaller end of the range")
                ) from None
    return {name: np.array([rests[row][name] for row in range(len(values))]) for name in rests[middle]}
