"""The pitch of a screw, for joints and constraints alike."""

from __future__ import annotations

from eomgen.scene.formula_nodes import Formula
from eomgen.scene.formula_scope import PARAMETERS
from eomgen.scene.values import Values


def read_pitch(key: str, pitch: float | str, values: Values) -> Formula:
    """Return the travel of a screw in m/rad, which is not zero at the default parameters."""
    formula = values.formula(key, pitch, PARAMETERS)
    if values.value(formula) == 0.0:
        values.report.add(key, "a screw with a pitch of 0 does not travel", 'a pitch in m/rad, or type = "revolute"')
    return formula
