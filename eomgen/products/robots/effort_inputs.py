"""Efforts of joints as inputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.formula.words import RESERVED


@dataclass(frozen=True)
class Actuation:
    """Inputs and efforts of actuators with transmissions, the driven joints, notes and warnings."""

    inputs: Mapping[str, Any]
    efforts: Mapping[str, Any]
    driven: Collection[str]
    notes: Sequence[str]
    warnings: Sequence[tuple[int, str]]


NO_ACTUATION = Actuation({}, {}, (), (), ())


#: Unit of an effort by the unit of the coordinate.
_EFFORT_UNITS = {"rad": "N m", "m": "N"}


def effort_inputs(units: Mapping[str, str], actuators: Actuation) -> dict[str, Any]:
    """Return the sections ``inputs`` and ``efforts``: first of actuators, then of driven joints, in order.

    The name of an input is the name of the joint, with ``_effort`` appended if the name is a word of formulas or an
    actuator. Empty sections are left out.

    Parameters
    ----------
    units : mapping
        Units of the coordinates of joints; joints of several coordinates have no input.
    actuators : Actuation
    """
    inputs, efforts = dict(actuators.inputs), dict(actuators.efforts)
    for joint, unit in units.items():
        if unit not in _EFFORT_UNITS:
            continue
        name = f"{joint}_effort" if joint in RESERVED | inputs.keys() else joint
        inputs[name] = {"unit": _EFFORT_UNITS[unit], "description": f"effort of joint {joint}"}
        efforts[joint] = {"joint": joint, "effort": name}
    return {name: section for name, section in (("inputs", inputs), ("efforts", efforts)) if section}
