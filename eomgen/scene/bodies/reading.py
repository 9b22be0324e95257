"""Reading of rigid bodies, points and frames on bodies, and the base's motion by position and rotation or by
acceleration."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.data import replace
from eomgen.base.messages import key_of
from eomgen.formula.evaluate import symbols
from eomgen.formula.integration import Integration, IntegrationError, SecondIntegral
from eomgen.formula.nodes import ZERO, Application, Formula, Number
from eomgen.formula.recording import law_and_rate
from eomgen.formula.substitution import total
from eomgen.formula.units.conversion import unit_fault
from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.formula.units.table import measure
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.design_poses import Axes, attach
from eomgen.scene.formula.scope import ACCELERATION, MOTION, PARAMETERS
from eomgen.scene.reading import report
from eomgen.scene.reading.key_metadata import added_keys
from eomgen.scene.reading.values import UNKNOWN, Values, read_orientation, read_placement
from eomgen.scene.rotations import quaternion_of_matrix, rows
from eomgen.scene.signals.curves import check_twice_differentiable
from eomgen.system.description import BASE, WORLD, FixedFrame, Point

if TYPE_CHECKING:
    from eomgen.scene.bodies import schema as written
    from eomgen.scene.bodies.base_schema import BaseEntry as WrittenBase
    from eomgen.scene.section import Reading

_UNIT = "m/s^2"
#: Inertia (xx, yy, zz, xy, xz, yz).
_Inertia = tuple[Formula, Formula, Formula, Formula, Formula, Formula]


def read_base(reading: Reading) -> Base | None:
    """Return the prescribed motion of the base; None without the section. Formulas of position and rotation have to be
    twice differentiable; second integrals of accelerations, and keys of products, are added. Faults are reported."""
    base: WrittenBase | None = reading.document.table("base")
    values = reading.values
    if base is None:
        return None
    position = values.vector("base.position", base.position, MOTION)
    rotations = values.rotations("base.rotation", base.rotation, MOTION)
    for key, formulas in (("base.position", position), ("base.rotation", [rotation.angle for rotation in rotations])):
        check_twice_differentiable(key, formulas, values.report)
    made = Base(position, rotations)
    if base.acceleration is not None:
        made = _add_acceleration(made, base.acceleration, base.drift, reading)
    elif base.drift is not None:
        fault = "drift belongs to the integral of an acceleration, and the base has no acceleration [E1386]"
        values.report.add("base.drift", fault, 'acceleration = ["quake(t)", 0, 0]')
    for row in added_keys("base"):
        if (value := getattr(base, row.added)) is not None:
            made = row.read(value, made, values)
    return made


def _add_acceleration(base: Base, acceleration: Sequence[float | str], drift: str | None, reading: Reading) -> Base:
    """Return a base with the second integrals of ``acceleration``, a formula of time per axis, added to the position.
    ``drift`` is ``remove``, ``keep`` or None, which adds a note on a drift: an acceleration that holds on, or a speed
    at the end, or in the mean, above 2 % of the largest speed. Faulty or inexact integrals are reported and left out,
    and accelerations that are zero during the run, or last much longer, are noted."""
    values, duration = reading.values, reading.document.simulation.duration
    units = {name: entry.unit for name, entry in reading.document.section("curves").items()}
    position, integrals = list(base.position), {}
    tunable = frozenset(name for name, is_tunable in values.names.parameters.items() if is_tunable)
    for axis, written_formula in enumerate(acceleration):
        key = f"base.acceleration[{axis}]"
        formula = values.formula(key, written_formula, ACCELERATION)
        if formula is UNKNOWN or _is_motion(key, formula, values) or _misfits(key, formula, units, values):
            continue
        try:
            integral = Integration(key, values.parameters, tunable, duration, drift == "remove").integral(formula)
        except IntegrationError as error:
            values.report.add_error(key, error)
            continue
        law = law_and_rate(integral.formula, values.parameters)
        displacements, speeds = law(np.linspace(0.0, integral.end, 1025))
        if (off := integral.error * integral.end) > 0.01 * np.max(np.abs(displacements)):
            fault = f"the integral by polynomials is off by about {off:.1g} m at t = {integral.end:.6g} s [E1391]"
            values.report.add(key, fault, "a formula without poles and jumps, or a curve through its values")
            continue
        position[axis] = total(position[axis], integral.formula)
        if integral.end > 0.0:
            integrals[axis] = _describe(key, integral)
            speed = max(abs(integral.velocity), abs(integral.displacement) / integral.end)
            if drift is None and (speed > 0.02 * np.max(np.abs(speeds)) or integral.onward != 0.0):
                remedy = 'drift = "remove"; or drift = "keep" if that motion is meant'
                values.note([f"{integrals[axis]}; try: {remedy} [W0296]"])
        if duration > 0.0 and written_formula != 0.0:
            if not np.any(law(np.linspace(0.0, duration, 1025))[1]):
                fault = f"{key} is zero from t = 0 to {duration:.6g} s, the end of the run"
                values.note([f"{fault}; try: a curve that begins at t = 0 [W0297]"])
            elif integral.end > 50.0 * duration:
                fault = f"{key} lasts {integral.end:.6g} s, and the run {duration:.6g} s"
                remedy = 'argument_unit = "ms" of a table whose times are in milliseconds'
                values.note([f"{fault}; try: {remedy} [W0298]"])
    x, y, z = position
    return replace(base, position=(x, y, z), integrals=integrals)


def _describe(key: str, integral: SecondIntegral) -> str:
    """Return a sentence on the integral of the acceleration with the key ``key``: drift, acceleration held on,
    correction and error, as far as these are not zero."""
    texts = [f"{key} is integrated from t = 0"]
    if integral.velocity or integral.displacement:
        drift = f"by {integral.displacement:.3g} m, and goes at {integral.velocity:.3g} m/s"
        texts.append(f"it drifts {drift} at t = {integral.end:.6g} s")
    if integral.onward:
        texts.append(f"its curve holds {integral.onward:.3g} {_UNIT} from then on")
    if integral.correction:
        texts.append(f"its drift is removed by at most {integral.correction:.2g} {_UNIT}")
    if integral.error:
        texts.append(f"its quadrature is off by about {integral.error * integral.end:.1g} m there")
    return "; ".join(texts)


def _is_motion(key: str, formula: Formula, values: Values) -> bool:
    """Return whether the formula of an acceleration has an input with motion = true, which is reported, because the
    caller gives positions."""
    known = symbols(formula)
    name = next((name for name, law in values.names.motions.items() if symbols(law) <= known), "")
    if name:
        fault = f"the motion {name} has a position, and no acceleration that is known when the scene is read [E1392]"
        hint = f'position = ["{name}", 0, 0], whose caller gives position, rate and acceleration'
        values.report.add(key, fault, hint)
    return bool(name)


def _misfits(key: str, formula: Formula, labels: Mapping[str, str], values: Values) -> bool:
    """Return whether the formula of an acceleration is a curve labelled in another unit than m/s^2, which is reported.
    ``labels`` are the units of curves by name."""
    label = labels.get(formula.curve.name, "").strip() if isinstance(formula, Application) else ""
    if not isinstance(formula, Application) or formula.derivative or not label:
        return False

    name = formula.curve.name
    try:
        factors = read_unit(label)
        fault = unit_fault(label, factors, _UNIT)
        factor = 1.0 if fault is not None else float(measure(factors)[0])
    except UnitError:  # a label that is not a unit
        return False
    if fault is not None:
        hint = {"m": f'position = ["{name}(t)", 0, 0]', "m/s": "the derivative of the points, or their integral"}
        default_hint = f"a curve in {_UNIT}; value_unit of a table converts"
        text = f"the curve {name} is in {label}, and an acceleration in {_UNIT} [E1393]"
        values.report.add(key, text, hint.get(label, default_hint))
    elif factor != 1.0:
        text = f"the curve {name} is labelled {label}, and labels do not convert: its values are in {_UNIT} [E1394]"
        values.report.add(key, text, f'value_unit = "{label}" in its table, and unit = "{_UNIT}"')
    return fault is not None or factor != 1.0


def read_body(name: str, body: written.BodyEntry, reading: Reading) -> Body:
    """Return a rigid body."""
    return Body(name, **reading.values.keys(key_of("bodies", name), body, "inertia", "center_of_mass", "mass"))


def placed_body(body: Body, entry: written.BodyEntry, values: Values) -> Body:
    """Return a body with centre of mass and inertia in the body's frame, if the entry gives both in another frame at
    the design position; otherwise the given body."""
    if entry.given_in is None:
        return body
    positioned, eye = "center_of_mass" in entry.model_fields_set, rows(np.eye(3))
    center, axes = read_placement(
        key_of("bodies", body.name), entry.given_in, positioned, body.name, body.center_of_mass, eye, values,
        "center_of_mass",
    )  # fmt: skip  # arguments of one place
    return replace(body, center_of_mass=center, inertia=_rotate(body.inertia, axes))


def _rotate(inertia: _Inertia, axes: Axes) -> _Inertia:
    """Return the six entries of R I R^T, formulas, for the inertia I (xx, yy, zz, xy, xz, yz) and constant axes R;
    zeros stay out of the formulas."""
    xx, yy, zz, xy, xz, yz = inertia
    table = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))

    def entry(row: int, column: int) -> Formula:
        terms = [
            part if weight == 1.0 else Number(weight) * part
            for k, j in itertools.product(range(3), range(3))
            if (weight := axes[row][k] * axes[column][j]) != 0.0 and (part := table[k][j]) != ZERO
        ]
        return sum(terms[1:], terms[0]) if terms else ZERO

    return entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)


def read_body_frame(name: str, frame: written.BodyFrame, reading: Reading) -> FixedFrame:
    """Return the frame of an entry of [frames], with position and axes in the body; on a geometrically exact beam the
    body is the nearest node. Faults are reported."""
    key, values = key_of("frames", name), reading.values
    if frame.body not in reading.bodies:
        report.check_reference(f"{key}.body", frame.body, [BASE, WORLD, *reading.bodies], "body", values.report)
    position = values.vector(f"{key}.position", frame.position, PARAMETERS)
    orientation = read_orientation(key, frame.rotation, frame.orientation, values)
    positioned = "position" in frame.model_fields_set
    position, orientation = read_placement(key, frame.given_in, positioned, frame.body, position, orientation, values)
    made = FixedFrame(name, frame.body, position, orientation, quaternion_of_matrix(orientation))
    return attach(made, reading.attach, f"{key}.position")


def read_point(name: str, point: written.PointEntry, reading: Reading) -> Point:
    """Return the point of an entry of [points], with the position in the body, m; on a geometrically exact beam the
    body is the nearest node. Faults are reported."""
    key, values = key_of("points", name), reading.values
    if point.body not in reading.bodies:
        report.check_reference(f"{key}.body", point.body, [BASE, WORLD, *reading.bodies], "body", values.report)
    vector, positioned = values.keys(key, point, "position")["position"], "position" in point.model_fields_set
    position, _ = read_placement(key, point.given_in, positioned, point.body, vector, rows(np.eye(3)), values)
    return attach(Point(name, point.body, position), reading.attach, f"{key}.position")
