"""Outputs from the written form: formulas, the motion of points, energies, each with its unit."""

from __future__ import annotations

from eomgen.scene.document import checks
from eomgen.scene.document import schema as written
from eomgen.scene.formula.nodes import Formula, Symbol
from eomgen.scene.formula.scope import ENERGIES, EVERYTHING
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Output
from eomgen.text import key_of

#: Units of outputs that do not say theirs; energies are J, powers W.
_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def read_output(name: str, output: written.Output, values: Values) -> Output:
    """Return an output; where it says no unit, that of its kind."""
    key = key_of("outputs", name)
    kinds = ("position", "velocity", "acceleration", "formula", "energy")
    given = [kind for kind in kinds if getattr(output, kind) is not None]
    formulas: tuple[Formula, ...] = ()
    if len(given) != 1:
        got = " and ".join(given) or "none"
        values.report.add(key, f"an output needs one of {', '.join(kinds)}, not {got}", 'position = "tip"')
    elif output.formula is not None:
        if not output.formula:
            values.report.add(f"{key}.formula", "the list of formulas is empty", "a formula")
        formulas = tuple(
            values.formula(f"{key}.formula[{place}]", entry, EVERYTHING) for place, entry in enumerate(output.formula)
        )
    elif output.energy is not None:
        checks.check_reference(f"{key}.energy", output.energy, ENERGIES, "energy", values.report)
        formulas = (Symbol("energy", output.energy),)
    else:
        kind, point = given[0], str(getattr(output, given[0]))
        checks.check_reference(f"{key}.{kind}", point, values.names.points, "point", values.report)
        formulas = tuple(Symbol(kind, point, index) for index in range(3))
    unit = output.unit or (_UNITS.get(given[0], "") if len(given) == 1 else "")
    if output.energy is not None:
        unit = output.unit or ("W" if output.energy.endswith("power") else "J")
    return Output(name, formulas, unit, output.description)
