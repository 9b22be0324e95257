"""From nested data, as a file or a builder holds it, to a checked Scene; everything wrong is reported at once."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from eomgen.errors import Problem
from eomgen.scene import checks, scene, schema_bodies, schema_forces
from eomgen.scene import schema as written
from eomgen.scene.beam_frames import check_frames, check_not_absolute
from eomgen.scene.beam_places import check_places
from eomgen.scene.beams import read_beam
from eomgen.scene.bushings import read_bushing
from eomgen.scene.constraint import Constraint
from eomgen.scene.constraints import check_closings, read_constraint
from eomgen.scene.control_section import (
    made_parameters,
    outputs_of_controllers,
    read_controllers,
    states_of_controllers,
)
from eomgen.scene.controllers import check_loops
from eomgen.scene.corners import applications
from eomgen.scene.curve import AnyCurve
from eomgen.scene.curve_checks import check_twice_differentiable
from eomgen.scene.curves import Curves, digest
from eomgen.scene.document import read_document
from eomgen.scene.force_elements import Bushing
from eomgen.scene.formula_nodes import Formula, Operation, Symbol
from eomgen.scene.formula_scope import ENERGIES, EVERYTHING, PARAMETERS, SPRING_FORCE, STATE, TIME, VELOCITY_SIZE, Names
from eomgen.scene.frames import check_two_bodies
from eomgen.scene.joint_limits import check_within_half_a_turn
from eomgen.scene.joints import read_joint
from eomgen.scene.limit_notes import beyond_limits
from eomgen.scene.mimics import check_mimics
from eomgen.scene.names import key_of
from eomgen.scene.part import Part, signature
from eomgen.scene.report import Report
from eomgen.scene.roads import Harmonic
from eomgen.scene.schema_control import State
from eomgen.scene.schema_signals import Input
from eomgen.scene.tree import Link, ordered
from eomgen.scene.tyres import read_tyre
from eomgen.scene.values import Values
from eomgen.scene.written_units import in_si


def from_data(
    data: Mapping[str, Any],
    *,
    file: str = "scene",
    lines: Mapping[str, int | str] | None = None,
    problems: Sequence[Problem] = (),
    notes: Sequence[str] = (),
    metadata: Mapping[str, Any] | None = None,
    inertias_checked: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    folder: Path | None = None,
) -> scene.Scene:
    """Check nested data, in the form of a scene file, and return the scene.

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file.
    file, lines : str, mapping
        Where the data came from, for messages: the line of each dotted key, or ``file:line``.
    problems : sequence of Problem
        Found before, to be reported together with what is found here.
    notes, metadata
        Handed on to the scene.
    inertias_checked : bool
        True where whoever made the data has judged the inertias already.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of what the data say.
    folder : Path, optional
        Where the paths of tables start; the current folder by default.

    Raises
    ------
    DescriptionError
        With every problem that could be found.
    """
    report = Report(file, lines or {})
    report.found += [(0, problem) for problem in problems]
    if not data and not report.found:
        report.add("", "the scene is empty", 'format = 1, name = "...", and [bodies] and [joints]')
        report.raise_problems()
    part = Part(dict(data), {})
    if "include" in data:
        from eomgen.scene.include import with_included  # noqa: PLC0415  # most scenes have none

        part = with_included(data, report, folder or Path())
        report.lines = part.lines
    data, labels = in_si(part.data, report)
    document, refused = read_document(data, report)
    if coordinates is not None:
        document = document.model_copy(update={"coordinates": coordinates})
    document = checks.check_names(document, refused, report)
    assembler = _Assembler(document, refused, data, report, folder or Path())
    for key, text in part.bound.items():
        assembler.values.formula(key, text, PARAMETERS)
    result = assembler.fields(data.get("bodies", ()) if inertias_checked else part.judged)
    report.raise_problems()
    curves = result["curves"]
    settled = result["simulation"].start == "equilibrium"
    outside = [
        note
        for joint in result["joints"]
        if joint.stops and not settled
        for note in beyond_limits(joint, joint.initial_position, assembler.values.value)
    ]
    return scene.Scene(
        **result,
        source={key: report.place(key) for key in report.lines},
        content=content(document) + (digest(curves).encode() if curves else b"") + signature(part.spaces),
        notes=(*notes, *part.notes, *labels, *outside),
        metadata=dict(metadata or {}),
    )


def content(document: written.Document) -> bytes:
    """Return bytes that determine the scene: canonical JSON, with entries as pairs because their order counts."""
    data = document.model_dump(mode="json", exclude_none=True, exclude={"include"})
    for section in written.SECTIONS:
        data[section] = [[name, entry] for name, entry in data[section].items()]
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


#: Units of outputs that do not say theirs; energies are J, powers W.
_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


class _Assembler:
    def __init__(
        self,
        document: written.Document,
        refused: Mapping[str, set[str]],
        data: Mapping[str, Any],
        report: Report,
        folder: Path,
    ) -> None:
        self.document = document
        self.refused = refused
        self.report = report
        self.joint_types: dict[str, str] = {name: joint.type for name, joint in document.joints.items()}
        for name in sorted(refused["joints"]):
            entry = data["joints"].get(name)
            kind = entry.get("type") if isinstance(entry, Mapping) else None
            self.joint_types[name] = kind if isinstance(kind, str) and kind in VELOCITY_SIZE else ""
        self.parameters = [
            *(scene.Parameter(name, p.value, p.tunable, p.unit, p.description) for name, p in document.parameters.items()),
            *made_parameters(document.controllers),
        ]
        self.curve_table: dict[str, AnyCurve] = {}
        self.elastic = dict.fromkeys((*document.beams, *sorted(refused["beams"])), 0)
        names = Names(
            parameters={**{p.name: p.tunable for p in self.parameters}, **dict.fromkeys(sorted(refused["parameters"]), False)},
            inputs=(*document.inputs, *sorted(refused["inputs"])),
            states=(
                *document.states,
                *sorted(refused["states"]),
                *states_of_controllers(document.controllers),
            ),
            controllers=(*outputs_of_controllers(document.controllers), *sorted(refused["controllers"])),
            joints=self.joint_types,
            beams=self.elastic,
            points=(*document.points, *sorted(refused["points"])),
            springs=(*document.springs, *sorted(refused["springs"])),
            curves=self.curve_table,
            tyres=(*document.tyres, *sorted(refused["tyres"])),
        )
        defaults = {parameter.name: parameter.value for parameter in self.parameters}
        self.values = Values(names, defaults, report, frozenset().union(*refused.values()))
        self.broken = sorted(refused["bodies"] | refused["beams"])
        self.bodies = [*document.bodies, *document.beams, *self.broken]
        self.curves = Curves(self.values, folder)
        for name, entry in document.curves.items():
            self.curve_table[name] = self.curves.curve(key_of("curves", name), name, entry)

    def fields(self, judged: Collection[str]) -> dict[str, Any]:
        """Return the fields of the Scene; they are right only if the report stays empty. The inertias of ``judged`` are fine."""
        document, values = self.document, self.values
        bodies = {name: self.body(name, body) for name, body in document.bodies.items()}
        bodies |= {name: read_beam(name, beam, values) for name, beam in document.beams.items()}
        self.elastic |= {name: body.beam.size for name, body in bodies.items() if body.beam is not None}
        joints = {name: read_joint(name, joint, values) for name, joint in document.joints.items()}
        links = [Link(joint.name, joint.parent, joint.child) for joint in joints.values()]
        complete = not self.refused["joints"] and not self.broken
        sections = {name: "bodies" if body.beam is None else "beams" for name, body in bodies.items()}
        order = ordered(links, sections, self.broken, complete, self.report)
        check_mimics(joints, self.refused["joints"], self.report)
        inertias = checks.body_inertias(bodies.values(), values)
        unjudged = {name: entry for name, entry in inertias.items() if name not in judged and sections[name] == "bodies"}
        checks.check_inertias(unjudged, self.report)
        inertias = {name: entry for name, entry in inertias.items() if not self.report.concerns(key_of(sections[name], name))}
        if complete and len(order) == len(links) == len(bodies):
            tree = [joints[link.name] for link in order]
            checks.check_motion(tree, inertias, sections, values, absolute=document.coordinates == "absolute")
            check_frames(tree, bodies, values)
        points = {name: self.point(name, point) for name, point in document.points.items()}
        constraints = tuple(
            read_constraint(name, entry, self.bodies, points, values) for name, entry in document.constraints.items()
        )
        bushings = [read_bushing(name, entry, self.bodies, points, values) for name, entry in document.bushings.items()]
        if complete:
            tree = [joints[link.name] for link in order]
            check_closings(constraints, tree, document.beams, self.report)
            for bushing in bushings:
                check_two_bodies("bushings", bushing.name, bushing.first, bushing.second, tree, document.beams, self.report)
        if document.coordinates == "absolute":
            check_within_half_a_turn(joints.values(), values, self.report)
            check_not_absolute(document.beams, self.report)
        inputs = tuple(self.input(name, entry) for name, entry in document.inputs.items())
        states = [self.state(name, entry) for name, entry in document.states.items()]
        control = read_controllers(document.controllers, document.springs, document.outputs, values)
        springs = tuple(self.spring(name, spring) for name, spring in document.springs.items())
        check_loops(control.outputs, springs, values)
        forces = tuple(self.force(name, force) for name, force in document.forces.items())
        framed: dict[str, Sequence[Constraint | Bushing]] = {"constraints": constraints, "bushings": bushings}
        check_places(bodies, joints.values(), points.values(), forces, framed, values)
        checks.check_groups(document, self.report)
        checks.check_simulation(document.simulation, self.report)
        simulation = document.simulation
        return {
            "name": document.name,
            "description": document.description,
            "terms": tuple(dict.fromkeys(document.terms)),
            "gravity": values.vector("gravity", document.gravity, PARAMETERS),
            "bodies": tuple(bodies[link.child] for link in order if link.child in bodies),
            "joints": tuple(joints[link.name] for link in order),
            "parameters": tuple(self.parameters),
            "curves": tuple(self.curve_table.values()),
            "inputs": inputs,
            "states": (*states, *control.states),
            "controllers": tuple(control.outputs),
            "feedback": tuple(control.feedback),
            "base": self.base(),
            "constraints": constraints,
            "coordinates": document.coordinates,
            "groups": {name: body.group for name, body in document.bodies.items() if body.group is not None},
            "points": tuple(points.values()),
            "springs": springs,
            "torsion_springs": tuple(self.torsion_spring(name, spring) for name, spring in document.torsion_springs.items()),
            "bushings": tuple(bushings),
            "tyres": tuple(read_tyre(name, tyre, points, values) for name, tyre in document.tyres.items()),
            "forces": forces,
            "efforts": tuple(self.effort(name, effort) for name, effort in document.efforts.items()),
            "outputs": tuple(self.output(name, output) for name, output in document.outputs.items()),
            "simulation": scene.Simulation(
                simulation.method, simulation.step, simulation.duration, simulation.rho_inf, simulation.record_every,
                simulation.alpha, simulation.beta, simulation.gamma, simulation.start,
                simulation.tolerance, simulation.order,
            ),
        }

    def input(self, name: str, entry: Input) -> scene.Input:
        key = key_of("inputs", name)
        parts: list[Formula] = []
        if entry.formula is not None:
            parts.append(self.values.formula(f"{key}.formula", entry.formula, TIME))
        parts += self.curves.signal(key, entry)
        harmonics: tuple[Harmonic, ...] = ()
        if entry.road is not None:
            found = self.curves.road(f"{key}.road", entry.road)
            parts += [] if isinstance(found, tuple) else [found]
            harmonics = found if isinstance(found, tuple) else ()
        for part in parts:
            self.curve_table |= {at.curve.name: at.curve for at in applications(part)}
        formula = functools.reduce(lambda x, y: Operation("add", (x, y)), parts) if parts else None
        return scene.Input(name, formula, entry.unit, entry.description, harmonics)

    def state(self, name: str, entry: State) -> scene.State:
        key = key_of("states", name)
        rate = self.values.formula(f"{key}.rate", entry.rate, STATE)
        initial = self.values.constant(f"{key}.initial", entry.initial)
        return scene.State(name, rate, initial, entry.unit, entry.description)

    def base(self) -> scene.Base | None:
        base = self.document.base
        if base is None:
            return None
        position = self.values.vector("base.position", base.position, TIME)
        rotations = self.values.rotations("base.rotation", base.rotation, TIME)
        for key, formulas in (("base.position", position), ("base.rotation", [rotation.angle for rotation in rotations])):
            check_twice_differentiable(key, formulas, self.report)
        return scene.Base(position, rotations)

    def body(self, name: str, body: schema_bodies.Body) -> scene.Body:
        key, formula = key_of("bodies", name), self.values.formula
        entries = enumerate(body.inertia)
        xx, yy, zz, xy, xz, yz = (formula(f"{key}.inertia[{place}]", entry, PARAMETERS) for place, entry in entries)
        center = self.values.vector(f"{key}.center_of_mass", body.center_of_mass, PARAMETERS)
        return scene.Body(name, formula(f"{key}.mass", body.mass, PARAMETERS), center, (xx, yy, zz, xy, xz, yz))

    def point(self, name: str, point: schema_bodies.Point) -> scene.Point:
        key = key_of("points", name)
        checks.check_reference(f"{key}.body", point.body, [scene.BASE, scene.WORLD, *self.bodies], "body", self.report)
        return scene.Point(name, point.body, self.values.vector(f"{key}.position", point.position, PARAMETERS))

    def spring(self, name: str, spring: schema_forces.Spring) -> scene.Spring:
        key, formula = key_of("springs", name), self.values.formula
        known = True
        for field, point in (("first", spring.first), ("second", spring.second)):
            known = checks.check_reference(f"{key}.{field}", point, self.values.names.points, "point", self.report) and known
        if known and spring.first == spring.second:
            self.report.add(f"{key}.second", f"the spring connects the point {spring.first} to itself", "another point")
        fields = ("stiffness", "damping", "length")
        stiffness, damping, length = (formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields)
        force = formula(f"{key}.force", spring.force, SPRING_FORCE)
        return scene.Spring(name, spring.first, spring.second, stiffness, damping, length, force)

    def torsion_spring(self, name: str, spring: schema_forces.TorsionSpring) -> scene.TorsionSpring:
        key = key_of("torsion_springs", name)
        ends = (("first", spring.first, spring.first_index), ("second", spring.second, spring.second_index))
        for field, joint, index in ends:
            if field == "second" and not joint:
                continue
            known = checks.check_reference(f"{key}.{field}", joint, self.joint_types, "joint", self.report)
            angles = scene.ANGLES.get(self.joint_types[joint], 0) if known else 0
            if known and self.joint_types[joint] and not angles:
                what = f"the joint {joint} is {self.joint_types[joint]} and has no angle"
                self.report.add(f"{key}.{field}", what, "a revolute joint")
            elif angles and index >= angles:
                what = f"the {self.joint_types[joint]} joint {joint} has no angle {index}"
                self.report.add(f"{key}.{field}_index", what, "0" if angles == 1 else "0 or 1")
        if spring.first == spring.second in self.joint_types and spring.first_index == spring.second_index:
            self.report.add(f"{key}.second", f"the spring connects the joint {spring.first} to itself", "another joint, or none")
        fields = ("stiffness", "damping", "rest")
        constants = [self.values.formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields]
        stiffness, damping, rest = constants
        indices = {"first_index": spring.first_index, "second_index": spring.second_index}
        return scene.TorsionSpring(name, spring.first, spring.second, stiffness, damping, rest, **indices)

    def force(self, name: str, force: schema_forces.Force) -> scene.Force:
        key, vector = key_of("forces", name), self.values.vector
        if force.body in (scene.BASE, scene.WORLD):
            why = "its motion is prescribed" if force.body == scene.BASE else "it rests"
            self.report.add(f"{key}.body", f"a force on the {force.body} moves nothing: {why}", "a body")
        else:
            checks.check_reference(f"{key}.body", force.body, self.bodies, "body", self.report)
        point = vector(f"{key}.point", force.point, PARAMETERS)
        force_vector = vector(f"{key}.force", force.force, STATE)
        return scene.Force(name, force.body, point, force_vector, vector(f"{key}.torque", force.torque, STATE), force.axes)

    def effort(self, name: str, effort: schema_forces.Effort) -> scene.Effort:
        key = key_of("efforts", name)
        if checks.check_reference(f"{key}.joint", effort.joint, self.joint_types, "joint", self.report):
            kind = self.joint_types[effort.joint]
            size = VELOCITY_SIZE.get(kind, math.inf)
            if effort.index >= size:
                hint = f"an index from 0 to {size - 1}" if size else "a moving joint"
                self.report.add(f"{key}.index", f"the {kind} joint {effort.joint} has no component {effort.index}", hint)
        return scene.Effort(name, effort.joint, self.values.formula(f"{key}.effort", effort.effort, STATE), effort.index)

    def output(self, name: str, output: written.Output) -> scene.Output:
        key = key_of("outputs", name)
        kinds = ("position", "velocity", "acceleration", "formula", "energy")
        given = [kind for kind in kinds if getattr(output, kind) is not None]
        formulas: tuple[Formula, ...] = ()
        if len(given) != 1:
            got = " and ".join(given) or "none"
            self.report.add(key, f"an output needs one of {', '.join(kinds)}, not {got}", 'position = "tip"')
        elif output.formula is not None:
            if not output.formula:
                self.report.add(f"{key}.formula", "the list of formulas is empty", "a formula")
            formulas = tuple(
                self.values.formula(f"{key}.formula[{place}]", entry, EVERYTHING) for place, entry in enumerate(output.formula)
            )
        elif output.energy is not None:
            checks.check_reference(f"{key}.energy", output.energy, ENERGIES, "energy", self.report)
            formulas = (Symbol("energy", output.energy),)
        else:
            kind, point = given[0], str(getattr(output, given[0]))
            checks.check_reference(f"{key}.{kind}", point, self.values.names.points, "point", self.report)
            formulas = tuple(Symbol(kind, point, index) for index in range(3))
        unit = output.unit or (_UNITS.get(given[0], "") if len(given) == 1 else "")
        if output.energy is not None:
            unit = output.unit or ("W" if output.energy.endswith("power") else "J")
        return scene.Output(name, formulas, unit, output.description)
