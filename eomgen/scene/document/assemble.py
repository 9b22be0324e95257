"""Assembly of nested data, from a file or a builder, into a checked Scene; all problems are reported together."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, Literal

from eomgen.formula.curves import AnyCurve
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula
from eomgen.formula.wave_fields import WaveField
from eomgen.scene import scene
from eomgen.scene.bodies.beam_reading import read_beam
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.bodies.cosserat_reading import check_keys, is_exact, read_cosserat
from eomgen.scene.bodies.reading import read_base, read_body, read_body_frame, read_point
from eomgen.scene.control.controllers import (
    check_loops,
    made_parameters,
    outputs_of_controllers,
    read_controllers,
    states_of_controllers,
)
from eomgen.scene.control.references import read_reference
from eomgen.scene.control.sampled import sources_digest
from eomgen.scene.document import checks
from eomgen.scene.document import schema as written
from eomgen.scene.document.beam_attachments import check_frames, check_not_absolute, check_places
from eomgen.scene.document.beam_nodes import BeamNodes
from eomgen.scene.document.beam_stations import stations_of
from eomgen.scene.document.doubtful_beams import doubtful_beams
from eomgen.scene.document.doubtful_hulls import doubtful_hulls
from eomgen.scene.document.doubtful_springs import negative_laws, springs_within_bodies
from eomgen.scene.document.initial_places import initial_places, tyres_in_the_road
from eomgen.scene.document.out_of_scale import out_of_scale
from eomgen.scene.document.plain_angles import angles_of_several_turns
from eomgen.scene.document.plain_times import doubtful_times
from eomgen.scene.document.section_outputs import section_formulas
from eomgen.scene.document.units import in_si
from eomgen.scene.document.validation import read_document
from eomgen.scene.events.reading import read_event
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.forces.element import Site
from eomgen.scene.forces.hulls import Hull
from eomgen.scene.forces.register import ALL_BOUNDS, ELEMENTS
from eomgen.scene.forces.tyres import Tyre
from eomgen.scene.formula.scope import PARAMETERS, Names, Offered
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.constraint_reading import check_closings, read_constraint
from eomgen.scene.joints.frames import check_two_bodies
from eomgen.scene.joints.mimics import check_mimics
from eomgen.scene.joints.moved_inertia import check_motion
from eomgen.scene.joints.reaction_reading import read_reaction
from eomgen.scene.joints.reading import read_joint
from eomgen.scene.joints.tree import Link, ordered
from eomgen.scene.joints.unresisted import unresisted_motions
from eomgen.scene.random.reading import Processes
from eomgen.scene.reading.part import Part, signature
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.scene.signals.curves import Curves, digest
from eomgen.scene.signals.reading import piece_of, read_input, read_motion, read_output, read_state
from eomgen.scene.waves.level_water import LevelWater
from eomgen.scene.waves.reading import no_waves, read_waves, variables_as_parameters
from eomgen.system.description import Point, Simulation
from eomgen.system.events import mode_parameter
from eomgen.system.motions import Motion
from eomgen.system.signals import Parameter
from eomgen.text import key_of


def assemble(
    part: Part,
    report: Report,
    *,
    notes: Sequence[str],
    metadata: Mapping[str, Any],
    inertias_checked: bool,
    coordinates: Literal["joint", "absolute"] | None,
    folder: Path,
) -> scene.Scene:
    """Check the data of a scene, those of included files among them, and return the scene; arguments as of
    ``load.from_data``.

    Raises
    ------
    DescriptionError
    """
    data, labels = in_si(part.data, report)
    document, refused = read_document(data, report)
    if coordinates is not None:
        document = document.model_copy(update={"coordinates": coordinates})
    document = checks.check_names(document, refused, report)
    judged = data.get("bodies", ()) if inertias_checked else part.judged
    assembler = _Assembler(document, refused, data, report, folder, judged)
    for key, text in part.bound.items():
        assembler.reader().formula(key, text, PARAMETERS)
    result = assembler.fields()
    report.raise_problems()
    modes = (mode for item in result["inputs"] if item.random is not None for mode in item.random.modes)
    curves = [*result["curves"], *modes]
    equilibrium_start = result["simulation"].start == "equilibrium"
    outside = [
        note
        for joint in result["joints"]
        if joint.initial_position and not equilibrium_start
        for stop, limit in zip(joint.stops, joint.limits, strict=True)
        if (note := limit.passed(joint.initial_position[stop.index], assembler.values.value))
    ]
    seen = any(isinstance(element, Hull | Tyre) for element in result["elements"])
    from_joints = seen and result["base"] is None and not equilibrium_start
    places = initial_places(result["joints"], assembler.values) if from_joints else {}
    doubts = [
        *checks.unused_names(document, assembler.values),
        *angles_of_several_turns(part.data),
        *doubtful_times(part.data, document),
        *negative_laws(document),
        *springs_within_bodies(document),
        *out_of_scale(
            result["bodies"],
            result["joints"],
            result["points"],
            [frame.name for frame in result["frames"]],
            result["elements"],
            [name for name, beam in document.beams.items() if beam.section is not None and beam.section.shape],
            assembler.values,
        ),
        *checks.efforts_on_drives(document),
        *doubtful_beams(document, result["bodies"], result["points"], result["elements"], assembler.values),
        *doubtful_hulls(
            [element for element in result["elements"] if isinstance(element, Hull)], places, assembler.values
        ),
        *tyres_in_the_road(
            [element for element in result["elements"] if isinstance(element, Tyre)],
            result["points"],
            places,
            assembler.values,
        ),
        *assembler.values.notes,
    ]
    return scene.Scene(
        **result,
        source={key: report.place(key) for key in report.lines},
        content=content(document)
        + (digest(curves).encode() if curves else b"")
        + sources_digest(result["sampled"])
        + signature(part.spaces),
        notes=(*notes, *part.notes, *labels, *outside, *assembler.unresisted, *doubts),
        metadata=dict(metadata or {}),
    )


def content(document: written.Document) -> bytes:
    """Return bytes that determine the scene: canonical JSON, with entries as pairs because their order counts."""
    data = document.model_dump(mode="json", exclude_none=True, exclude={"include", "repeat"})
    for section in written.SECTIONS:
        data[section] = [[name, entry] for name, entry in data[section].items()]
    for section in ("reactions", "references", "modes", "events", "frames", "task_frames", "random", "waves"):
        if not data[section]:
            del data[section]
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def _parameters_of(motion: Motion) -> list[Parameter]:
    """Return the tunable parameters of a motion at rest."""
    begin, *coefficients = motion.parameters
    made = [Parameter(begin, 0.0, True, "s", f"when the present piece of the motion {motion.name} begins")]
    for k, name in enumerate(coefficients):
        unit = f"{motion.unit}/s^{k}" if motion.unit and k > 1 else f"{motion.unit}/s" if motion.unit and k else ""
        what = f"of (t - {begin})^{k} in the motion {motion.name}" if k else f"where the motion {motion.name} begins"
        made.append(Parameter(name, 0.0 if k else motion.initial, True, unit or motion.unit, what))
    return made


class _Assembler:
    def __init__(
        self,
        document: written.Document,
        refused: Mapping[str, set[str]],
        data: Mapping[str, Any],
        report: Report,
        folder: Path,
        judged: Collection[str],
    ) -> None:
        self.document = document
        self.refused = refused
        self.report = report
        joint_types: dict[str, str] = {name: joint.type for name, joint in document.joints.items()}
        for name in sorted(refused["joints"]):
            entry = data["joints"].get(name)
            kind = entry.get("type") if isinstance(entry, Mapping) else None
            joint_types[name] = kind if isinstance(kind, str) and kind in JOINTS else ""
        self.parameters = [
            *(Parameter(name, p.value, p.tunable, p.unit, p.description) for name, p in document.parameters.items()),
            *made_parameters(document.controllers),
            *(
                Parameter(mode_parameter(name), mode.value, True, "", mode.description)
                for name, mode in document.modes.items()
            ),
        ]
        self.motions = {
            name: read_motion(name, entry, report) for name, entry in document.inputs.items() if entry.motion
        }
        self.parameters += [item for motion in self.motions.values() for item in _parameters_of(motion)]
        self.curve_table: dict[str, AnyCurve] = {}
        self.random_table: dict[str, Formula] = {}
        self.wave_table: dict[str, WaveField] = {}
        self.elastic = dict.fromkeys((*document.beams, *sorted(refused["beams"])), 0)
        tunable = {p.name: p.tunable for p in self.parameters} | dict.fromkeys(sorted(refused["parameters"]), False)
        names = Names(
            parameters=tunable,
            inputs=(*document.inputs, *sorted(refused["inputs"])),
            motions={name: piece_of(motion) for name, motion in self.motions.items()},
            random=self.random_table,
            states=(
                *document.states,
                *sorted(refused["states"]),
                *states_of_controllers(document.controllers),
            ),
            controllers=(*outputs_of_controllers(document.controllers), *sorted(refused["controllers"])),
            joints=joint_types,
            beams=self.elastic,
            exact_beams=tuple(name for name, beam in document.beams.items() if is_exact(beam)),
            constraints=(*document.constraints, *sorted(refused["constraints"])),
            reactions=(*document.reactions, *sorted(refused["reactions"])),
            bodies=dict.fromkeys(document.bodies),  # looked up for every point and force element
            points=dict.fromkeys([*document.points, *document.frames, *sorted(refused["points"] | refused["frames"])]),
            modes=(*document.modes, *sorted(refused["modes"])),
            references=(*document.references, *sorted(refused["references"])),
            curves=self.curve_table,
            curve_arguments={
                name: entry.argument_unit for name, entry in document.curves.items() if entry.argument_unit
            },
            waves=self.wave_table,
            offered={
                kind: Offered(row.section, scope, (*document.section(row.section), *sorted(refused[row.section])))
                for row in ELEMENTS
                for kind, scope in row.offers.items()
            },
        )
        self.names = names
        self.judged = {key_of("bodies", body, field) for body in judged for field in ("mass", "inertia")}
        self.values = self.reader()
        self.broken = sorted(refused["bodies"] | refused["beams"])
        self.bodies = dict.fromkeys([*document.bodies, *document.beams, *self.broken])
        self.unresisted: list[str] = []
        self.folder = folder
        self.curves = Curves(self.values, folder)
        for name, entry in document.curves.items():
            self.curve_table[name] = self.curves.curve(key_of("curves", name), name, entry)
        processes = Processes(self.values, self.curves, document.simulation.duration)
        self.random, variables = processes.read(document.random)
        self.tunable = tunable
        self.add_variables(variables)
        self.random_table |= {item.name: item.formula for item in self.random if item.formula is not None}
        self.random_table |= dict.fromkeys(set(document.random) - set(self.random_table) | refused["random"], UNKNOWN)

        self.read_waves()

    def add_variables(self, variables: Sequence[Parameter]) -> None:
        """Let what is read from here on know random variables as parameters."""
        self.parameters += variables
        self.tunable |= {item.name: True for item in variables}
        self.values.parameters = {**self.values.parameters, **{item.name: item.value for item in variables}}

    def read_waves(self) -> None:
        """Put the waves where formulas find them."""
        document, refused = self.document, self.refused["waves"]
        if document.waves or document.section("hulls"):
            # by a reader whose problems, notes and requirements are those of the key itself, when it is read
            aside = self.reader(Report(self.report.file, self.report.lines))
            gravity = aside.vector("gravity", document.gravity, PARAMETERS)
            down = [aside.value(part) for part in gravity]
            self.values.require("gravity", LevelWater(), gravity)
            tunable = any(self.names.parameters.get(symbol.name) for part in gravity for symbol in symbols(part))
            if document.waves and tunable:
                self.values.note(["waves have the gravity of the default parameters, whatever it is in a run"])
            for name, entry in document.waves.items():
                waves = read_waves(name, entry, math.hypot(*down), self.values)
                self.wave_table[name] = waves
                self.add_variables(variables_as_parameters(waves))
        self.wave_table |= {name: no_waves(name) for name in sorted(refused)}

    def reader(self, report: Report | None = None) -> Values:
        """Return a reader of values that has read nothing yet, and reports to the assembler's report or another."""
        defaults = {parameter.name: parameter.value for parameter in self.parameters}
        refused = frozenset().union(*self.refused.values())
        return Values(self.names, defaults, report or self.report, refused, self.judged, ALL_BOUNDS)

    def fields(self) -> dict[str, Any]:
        """Return the fields of the Scene; they are right only if the report stays empty."""
        document, values = self.document, self.values
        bodies = {name: read_body(name, body, values) for name, body in document.bodies.items()}
        for name, beam in document.beams.items():
            check_keys(name, beam, values)
        aside = self.reader(Report(self.report.file, self.report.lines))
        stations = stations_of(document, self.names.exact_beams, self.bodies, aside)
        exact = {name: read_cosserat(name, document.beams[name], values, places) for name, places in stations.items()}
        bodies |= {name: read_beam(name, beam, values) for name, beam in document.beams.items() if not is_exact(beam)}
        bodies |= {node.name: node for beam in exact.values() for node in beam.bodies()}
        nodes = BeamNodes(exact, values)
        self.elastic |= {name: body.beam.size for name, body in bodies.items() if body.beam is not None}
        nodes.check_names(document.joints)
        joints = {name: nodes.joint(read_joint(name, joint, values)) for name, joint in document.joints.items()}
        joints = {name: joint for name, joint in joints.items() if joint.child not in nodes.joints()} | nodes.joints()
        links = [Link(joint.name, joint.parent, joint.child) for joint in joints.values()]
        complete = not self.refused["joints"] and not self.broken
        sections = {name: "beams" if name in document.beams else "bodies" for name in bodies}
        order = ordered(links, sections, self.broken, complete, self.report)
        check_mimics(joints, self.refused["joints"], self.report)
        checks.check_inertias(bodies.values(), values)
        if complete and len(order) == len(links) == len(bodies):
            tree = [joints[link.name] for link in order]
            check_motion(tree, bodies, values, absolute=document.coordinates == "absolute")
            free = not document.constraints and not any(joint.drive for joint in tree)
            if document.coordinates == "joint" and free and not self.report.found:
                self.unresisted = unresisted_motions(
                    tree, checks.body_inertias(bodies.values(), values), sections, values
                )
            check_frames(tree, bodies, values)
        points = {
            name: nodes.point("points", read_point(name, point, self.bodies, values))
            for name, point in document.points.items()
        }
        fixed_frames = {
            name: nodes.point("frames", read_body_frame(name, frame, self.bodies, values))
            for name, frame in document.frames.items()
        }
        points |= {name: Point(name, frame.body, frame.position) for name, frame in fixed_frames.items()}
        checks.check_task_frames(document, self.refused, self.report)
        constraints = tuple(
            nodes.constraint(read_constraint(name, entry, self.bodies, points, values))
            for name, entry in document.constraints.items()
        )
        if complete:
            tree = [joints[link.name] for link in order]
            check_closings(constraints, tree, document.beams, self.report)
        if document.coordinates == "absolute":
            check_not_absolute([name for name in document.beams if name not in exact], self.report)
        inputs = []
        for name, entry in document.inputs.items():
            if name in self.motions:
                continue
            made, curves = read_input(name, entry, self.curves, values)
            inputs.append(made)
            self.curve_table |= curves
        inputs += self.random
        states = [state for name, entry in document.states.items() for state in read_state(name, entry, values)]
        control = read_controllers(
            document.controllers, document.section("springs"), document.outputs, values, self.folder
        )
        site = Site(self.bodies, document.beams, points, values, exact)
        elements = {
            row.section: tuple(
                nodes.element(row.read(name, entry, site)) for name, entry in document.section(row.section).items()
            )
            for row in ELEMENTS
        }
        check_loops(control.outputs, elements["springs"], values)
        for element in chain.from_iterable(elements.values()):
            frames = element.frames()
            if complete and frames is not None:
                check_two_bodies(element.section, element.name, *frames, tree, document.beams, self.report)
        check_places(
            bodies,
            joints.values(),
            {**points, **fixed_frames}.values(),
            chain.from_iterable(elements.values()),
            constraints,
            values,
        )
        checks.check_groups(document, self.report)
        absolute = document.coordinates == "absolute"
        events = tuple(
            read_event(name, entry, joints, self.names.modes, absolute, values)
            for name, entry in document.events.items()
        )
        of_sections = partial(section_formulas, exact, values)
        outputs = tuple(read_output(name, output, of_sections, values) for name, output in document.outputs.items())
        checks.check_drive_efforts(outputs, events, joints.values(), constraints, self.report)
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
            "inputs": tuple(inputs),
            "motions": tuple(self.motions.values()),
            "waves": tuple(self.wave_table[name] for name in document.waves),
            "states": (*states, *control.states),
            "controllers": tuple(control.outputs),
            "feedback": tuple(control.feedback),
            "sampled": tuple(control.sampled),
            "base": read_base(document.base, values),
            "constraints": constraints,
            "reactions": tuple(
                read_reaction(name, entry, self.bodies, points, values) for name, entry in document.reactions.items()
            ),
            "coordinates": document.coordinates,
            "groups": self.groups(exact.values()),
            "points": tuple(points.values()),
            "frames": tuple(fixed_frames.values()),
            "task_frames": tuple(dict.fromkeys(document.task_frames)),
            "elements": (
                *(CosseratBeam(name, beam) for name, beam in exact.items()),
                *chain.from_iterable(elements.values()),
            ),
            "outputs": outputs,
            "references": tuple(
                read_reference(
                    name, entry, frozenset(joint.name for joint in joints.values() if joint.mimic is not None), values
                )
                for name, entry in document.references.items()
            ),
            "modes": tuple(document.modes),
            "events": events,
            "requirements": tuple(values.requirements),
            "simulation": Simulation(
                simulation.method,
                simulation.step,
                simulation.duration,
                simulation.rho_inf,
                simulation.record_every,
                simulation.alpha,
                simulation.beta,
                simulation.gamma,
                simulation.start,
                simulation.tolerance,
                simulation.order,
                dict(simulation.settings),
                simulation.real,
            ),
        }

    def groups(self, exact: Iterable[Cosserat]) -> dict[str, str]:
        """Return the groups of bodies and of the nodes of geometrically exact beams, where the scene names them."""
        document = self.document
        of_nodes = {node: document.beams[beam.name].group for beam in exact for node in beam.nodes}
        of_bodies = {name: body.group for name, body in document.bodies.items()}
        return {name: group for name, group in (of_bodies | of_nodes).items() if group is not None}
