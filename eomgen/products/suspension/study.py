"""The study of an axle on a test rig: states of rest over travel, steering and loads, and the curves of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, names_of
from eomgen.base.data import dataclass
from eomgen.base.messages import nearest, shown
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.pipeline.documents import load_scene
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.suspension.curves import Car, Curves, Wheel, curves_of
from eomgen.products.suspension.result import SuspensionCurves

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
    opposite : whether it has the other sign on the right
    """

    name: str
    label: str
    unit: str
    parameter: str
    factor: float
    opposite: bool = False


SWEEPS = (
    Sweep("travel", "travel", "mm", "travel", 1e-3),
    Sweep("roll", "travel, left up and right down", "mm", "travel", 1e-3, opposite=True),
    Sweep("steering", "travel of the steering joint", "mm", "", 1e-3),
    Sweep("side force", "force to the left", "kN", "side", 1e3),
    Sweep("braking force", "force backward", "kN", "brake", 1e3),
    Sweep("driving force", "force forward", "kN", "drive", 1e3),
    Sweep("aligning moment", "moment to the left", "N m", "align", 1.0),
)


@checked_call('eomgen.suspension("front_axle.toml", ["left_hub", "right_hub"])')
def suspension(
    file: str | Path,
    hubs: Sequence[str],
    *,
    steering: str = "",
    radius: float = 0.3,
    travel: float = 0.08,
    steer: float = 0.06,
    force: float = 3000.0,
    moment: float = 100.0,
    rows: int = 33,
    other_axle: float = 0.0,
    height: float = 0.5,
    brake_share: float = 1.0,
    drive_share: float = 1.0,
    parameters: Mapping[str, float | str] | None = None,
) -> SuspensionCurves:
    """Return kinematics and compliance of an axle, at rest on a rig that holds the body of the car.

    The wheels stand on pads without friction. One quantity at a time varies about the design position: the travel of
    both pads, the same in opposite directions, the steering, and forces and moments at the contacts.

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
    travel, steer, force, moment : float
        Ends of the ranges: travel of the pads and of the steering joint, m (rad), forces, N, and moment, N m.
    rows : int
        States of rest in each range; an odd number has the design position among them.
    other_axle : float
        x of the other axle from this one, m: negative in front; 0: none, and support is given as an angle alone.
    height : float
        Of the car's centre of mass over the road, m.
    brake_share, drive_share : float
        Part of this axle in the forces of braking and of driving.
    parameters : mapping, optional
        Values in place of the file's parameters, fixed ones as well.

    Returns
    -------
    SuspensionCurves
        Curves of each range, and ``characteristics`` at the design position.

    Raises
    ------
    UsageError
        No such hub or joint, fewer than 5 rows, or a range that is not positive.
    NumericalError
        The wheels cannot be where the pads ask for, or forces do not balance.

    Examples
    --------
    >>> axle = "examples/car/system/front_axle.toml"
    >>> curves = eomgen.suspension(axle, ["left_hub", "right_hub"], steering="rack", radius=0.29, rows=5)
    >>> curves.curves["travel"].columns["left_hub camber"].round(2)
    array([-0.36, -0.17, -0.57, -1.82, -3.64])
    """
    names = names_of("hubs", "hubs", hubs, "left_hub")
    ends = {"travel": travel, "": steer, "align": moment}
    for what, value in (("travel", travel), ("steer", steer), ("force", force), ("moment", moment), ("radius", radius)):
        if not value > 0.0:
            raise UsageError(Problem(f"suspension: {what}", f"{value:.6g} is not positive [E2400]", f"{what}=0.05"))
    if rows < 5:
        raise UsageError(Problem("suspension: rows", f"{rows} rows give no slopes [E2401]", "rows=33"))
    model, springs = _rig(Path(file), names, steering, radius, dict(parameters or {}))
    _, design = _at(model, {})
    sides = {name: -1.0 if design[_OF_PAD.format(name) + "pose"][1] < 0.0 else 1.0 for name in names}
    car = Car(other_axle, height, brake_share, drive_share)
    curves: dict[str, Curves] = {}
    for sweep in SWEEPS:
        if not sweep.parameter and not steering:
            continue
        values = np.linspace(-1.0, 1.0, rows) * ends.get(sweep.parameter, force)
        outputs = _rests(model, sweep, values, sides)
        wheels = [
            Wheel(name, side, *(outputs[_OF_PAD.format(name) + part] for part in ("pose", "arm", "load")))
            for name, side in sides.items()
        ]
        lengths = {name: outputs[_LENGTH.format(name)] for name in springs}
        names_of_range = sweep.name, sweep.label, sweep.unit
        curves[sweep.name] = curves_of(names_of_range, values / sweep.factor, wheels, lengths, car)
    return SuspensionCurves(model.name, curves)


def _rig(
    file: Path, hubs: Sequence[str], steering: str, radius: float, parameters: dict[str, float | str]
) -> tuple[Model, tuple[str, ...]]:
    """Return the model of the axle on the rig, and the names of its springs. Raises UsageError for unknown names."""
    scene = load_scene(file)
    bodies, joints = [body.name for body in scene.bodies], [joint.name for joint in scene.joints]
    asked = [(name, "body", bodies) for name in hubs] + ([(steering, "joint", joints)] if steering else [])
    for name, kind, known in asked:
        if name not in known:
            fault = f"there is no {kind} {shown(name)} in the axle [E2402]"
            raise UsageError(Problem("suspension", fault, nearest(name, known) or f"one of {', '.join(known[:8])}"))
    springs = tuple(spring.name for spring in scene.springs)
    pads: dict[str, Any] = {
        f"{name}_pad": {"file": str(_PAD), "parent": name, "prefix": _OF_PAD.format(name), "parameters": {"radius": radius}}
        for name in hubs
    }
    rig: dict[str, Any] = {
        "format": 1,
        "name": scene.name,
        "include": {"axle": {"file": str(file.resolve()), "prefix": "", "parameters": parameters}, **pads},
        "outputs": {_LENGTH.format(name): {"formula": f"length.{name}", "unit": "m"} for name in springs},
    }
    if steering:
        rig["parameters"] = {_STEER: {"value": 0.0, "tunable": True}}
        rig["constraints"] = {_STEER: {"type": "formula", "equation": f"q.{steering} - {_STEER}"}}
    return build_for_run(rig, start="equilibrium"), springs


def _at(model: Model, values: Mapping[str, float], q: Array | None = None) -> tuple[Array, Mapping[str, Array]]:
    """Return configuration and outputs at rest, from a configuration near it."""
    rest = model.equilibrium(initial=None if q is None else {"q": q}, parameters=values)
    still = np.zeros(model.nv)
    return rest.q, model.outputs(rest.q, still, still, z=rest.z, multipliers=rest.multipliers, parameters=values)


def _rests(model: Model, sweep: Sweep, values: Array, sides: Mapping[str, float]) -> dict[str, Array]:
    """Return the outputs (rows, size) at rest over a range, from the middle outwards. Raises NumericalError."""
    found: dict[int, Mapping[str, Array]] = {}
    middle = len(values) // 2
    for side in (range(middle, len(values)), range(middle - 1, -1, -1)):
        q = None
        for row in side:
            signs = {name: hand if sweep.opposite else 1.0 for name, hand in sides.items()}
            asked = {f"{_OF_PAD.format(name)}{sweep.parameter}": sign * values[row] for name, sign in signs.items()}
            try:
                q, found[row] = _at(model, asked if sweep.parameter else {_STEER: values[row]}, q)
            except NumericalError as error:
                where = f"suspension: {sweep.name}, {values[row] / sweep.factor:.4g} {sweep.unit}"
                raise NumericalError(Problem(where, f"{error.problems[0].what}", "a smaller range")) from None
    return {name: np.array([found[row][name] for row in range(len(values))]) for name in found[middle]}
