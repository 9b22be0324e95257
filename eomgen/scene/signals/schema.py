"""Schema of parameters, definitions, states and outputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import model_validator

from eomgen.scene.formula.scope import EVERYTHING, FIXED_PARAMETERS, LOAD, STATE
from eomgen.scene.reading.key_metadata import ANY_UNIT, Table, key, of_fixed_parameters, optional
from eomgen.scene.reading.kinds import Description, Finite, Unit, Value, Values


class DefinitionEntry(Table):
    """A named expression, which formulas use by its name as if its text stood there."""

    short: ClassVar[str] = "formula"

    formula: Value = key("formula of all that may stand in formulas that mention it", unit=ANY_UNIT, names=EVERYTHING)
    unit: Unit = key("unit of its value; another one than its formula is known to have is refused", "")
    description: Description = key("text of one line for tables", "")

    @model_validator(mode="before")
    @classmethod
    def _from_formula(cls, data: object) -> object:
        return {"formula": data} if isinstance(data, str | int | float) and not isinstance(data, bool) else data


class StateEntry(Table):
    """An internal state z, which its rate moves, or which takes new values at times of its own."""

    rate_of_entry: ClassVar[str] = "rate"

    rate: Value | None = optional("its time derivative; required unless it is sampled", names=STATE)
    sample: Value | None = of_fixed_parameters("time between two samples of a sampled state", unit="s")
    formula: Value | None = optional("value of a sampled state from a sample to the next", unit=ANY_UNIT, names=LOAD)
    delay: Value | None = of_fixed_parameters("time from a sample to its effect", unit="s", shown_default="0")
    quantum: Value | None = of_fixed_parameters(
        "step of rounding of a sampled state: values are multiples of it", unit=ANY_UNIT, shown_default="not rounded"
    )
    initial: Value = key("value at the start", 0.0, unit=ANY_UNIT, names=FIXED_PARAMETERS)
    unit: Unit = key("label", "")
    description: Description = key("text of one line for tables", "")


class ParameterEntry(Table):
    """A named number."""

    value: Finite = key("no formula", unit=ANY_UNIT)
    tunable: bool = key("can be changed at every call without compiling again", False)
    unit: Unit = key("label", "")
    description: Description = key("text of one line for tables", "")

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}


def _section_key(description: str) -> Any:
    """Return the key of a quantity of the sections of a beam."""
    return optional(description, refers="beams", kind="[exact beam](exact_beams.md)")


class OutputEntry(Table):
    """A named quantity that is recorded along a run."""

    position: str | None = optional("3 components in world axes", refers="points")
    velocity: str | None = optional("3 components in world axes", refers="points")
    acceleration: str | None = optional("3 components in world axes", refers="points")
    formula: Values | None = optional("one component or several", names=EVERYTHING)
    reaction_force: str | None = optional(
        "3 components of the force through a joint or a constraint, see [reactions](reactions.md)",
        refers="reactions",
        kind="reaction, joint or constraint",
    )
    reaction_moment: str | None = optional("the moment there", refers="reactions", kind="reaction, joint or constraint")
    section_force: str | None = _section_key(
        "3 components in the axes of the section: axial force, shear force along y and along z, see"
        " [section loads](exact_beams.md#section-loads)"
    )
    section_moment: str | None = _section_key("the same of its torque and its bending moments about y and z")
    section_strain: str | None = _section_key("stretch, shear along y and along z")
    section_curvature: str | None = _section_key("twist, curvature about y and about z, less the values at rest")
    at: Value | None = of_fixed_parameters("x of the section along the beam at rest, for these four", unit="m")
    energy: str | None = optional(
        "J, or W for the powers", kind="`kinetic`, `potential`, `total`, `power`, `base_power`"
    )
    unit: Unit = key("label", "", shown_default="m, m/s, m/s², N, N m, 1/m, J or W by the kind of output")
    description: Description = key("title of its panel in the plot, or in the legend of a shared one", "")
