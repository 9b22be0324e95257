"""Checks across the entries of a scene: names, references, physical inertias, immobile joints, the time grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from eomgen.formula.evaluate import symbols
from eomgen.formula.words import RESERVED
from eomgen.random_processes import MOST_MODES
from eomgen.scene.control.controllers import made_by_controller, outputs_of_controllers, states_of_controllers
from eomgen.scene.control.sections import check_controllers
from eomgen.scene.document.schema import Document, section_keys
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.frames import check_two_bodies
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.reading.values import Values
from eomgen.scene.section import Reading
from eomgen.scene.sections import OWN
from eomgen.scene.signals.sections import CURVES
from eomgen.scene.tree.beam_attachments import check_places
from eomgen.scene.tree.sections import Tree
from eomgen.system.description import BASE, WORLD
from eomgen.system.events import mode_parameter
from eomgen.system.motions import motion_parameters
from eomgen.system.random_processes import variables_of
from eomgen.text import NAME_LENGTH, NAME_RULE, is_legal, key_of, listed, nearest, shown


def check_names(document: Document, refused: Mapping[str, set[str]], report: Report) -> Document:
    """Return the document without the entries whose names are not legal; their names go to ``refused``."""
    if not is_legal(document.name):
        report.add("name", f"the name {shown(document.name)} is not legal", NAME_RULE)
    kept: dict[str, object] = {}
    for section in section_keys(type(document)):
        entries = document.section(section)
        for name in [*entries, *sorted(refused[section])]:
            fault, hint = _fault(section, name, document)
            if fault:
                report.add(key_of(section, name), fault, hint)
                refused[section].add(name)
        kept[section] = {name: entry for name, entry in entries.items() if name not in refused[section]}
    return document.model_copy(update=kept)


#: Nouns of entries by section, of sections whose entries formulas call by their names alone. Of two entries of one name
#: the entry in the later section is reported; curves count as last.
_BARE = {row.key: row.bare for row in sorted(OWN, key=lambda row: row is CURVES) if row.bare}


def _fault(section: str, name: str, document: Document) -> tuple[str, str]:
    if not is_legal(name):
        return f"the name {shown(name)} is not legal", NAME_RULE
    if section in ("bodies", "beams") and name == BASE:
        return f"the name {BASE} is reserved for the frame that carries the tree", "another name"
    if section in ("bodies", "beams") and name == WORLD:
        return f"the name {WORLD} is reserved for what rests while the base moves", "another name"
    if section == "beams" and name in document.section("bodies"):
        return f"the name {name} is both a body and a beam", "another name for one of them"
    if section == "beams" and name in document.section("joints"):
        return f"the name {name} is both a joint and a beam, and q.{name} would be both", "another name for one of them"
    if section == "frames" and name in document.section("points"):
        return f"the name {name} is both a point and a frame", "the frame alone: its origin is a point"
    if section == "frames" and (name in document.section("bodies") or name in document.section("beams")):
        return f"the name {name} is both a body and a frame", "another name for the frame"
    if section == "constraints" and name in document.section("joints"):
        return f"the name {name} is both a joint and a constraint", "another name for one of them"
    if section in _BARE and name in RESERVED:
        return f"the name {name} is a word of formulas", f"{name}_value"
    for other, what in _BARE.items():  # formulas call all of them by their bare names
        if section not in _BARE or other == section:
            break
        if name in document.section(other):
            return f"the name {name} is both {what} and {_BARE[section]}", "another name for one of them"
    if section == "inputs" and name in document.section("inputs") and document.section("inputs")[name].motion:
        return _fault_of_motion(name, document)
    if section == "random" and name in document.section("random"):
        return _fault_of_variables("random process", name, MOST_MODES, document)
    if section == "waves" and name in document.section("waves") and document.section("waves")[name].variables:
        if name in document.section("random"):
            what = f"the name {name} is both a random process and waves with variables of their own"
            return what, "another name for one of them"
        sea = document.section("waves")[name]
        count = 2 * sea.components * (1 if sea.spreading is None else sea.spreading.directions)
        return _fault_of_variables("sea", name, count, document)
    if section == "modes" and mode_parameter(name) in document.section("parameters"):
        return f"the mode {name} is the parameter {mode_parameter(name)}, and there is one of that name", "another name"
    if section == "controllers" and name in document.section("controllers"):
        return _fault_of_made(name, document)
    return "", ""


def _fault_of_motion(name: str, document: Document) -> tuple[str, str]:
    """Return what is wrong with the names of the parameters that a motion has."""
    others = {entry: what for section, what in _BARE.items() for entry in document.section(section)}
    others |= {mode_parameter(mode): f"that of the mode {mode}" for mode in document.section("modes")}
    for other, entry in document.section("controllers").items():
        made = (made for names in made_by_controller(other, entry).values() for made in names)
        others |= dict.fromkeys(made, f"what the controller {other} makes")
    for parameter in motion_parameters(name):
        if len(parameter) > NAME_LENGTH:
            return f"the motion {name} has the parameter {parameter}, whose name is too long", "a shorter name"
        if parameter in others:
            fault = f"the motion {name} has the parameter {parameter}, and there is {others[parameter]} of that name"
            return fault, "another name for one of them"
    return "", ""


def _fault_of_variables(what_it_is: str, name: str, count: int, document: Document) -> tuple[str, str]:
    """Return what is wrong with the names of the parameters that a random process, or a sea, has."""
    last = variables_of(name, count)[-1]
    if len(last) > NAME_LENGTH:
        return f"the {what_it_is} {name} has parameters such as {last}, whose names are too long", "a shorter name"
    every = set(variables_of(name, count))
    for section, what in _BARE.items():
        for taken in every.intersection(document.section(section)):
            fault = f"the {what_it_is} {name} has the parameter {taken}, and there is {what} of that name"
            return fault, "another name for one of them"
    return "", ""


def _fault_of_made(name: str, document: Document) -> tuple[str, str]:
    """Return what is wrong with the names that a controller makes."""
    others = {
        made: other
        for other, entry in document.section("controllers").items()
        if other != name
        for names in made_by_controller(other, entry).values()
        for made in names
    }
    for section, names in made_by_controller(name, document.section("controllers")[name]).items():
        for made in names:
            if not is_legal(made):
                fault = f"the controller makes {_BARE[section]} {shown(made)}, whose name is"
                return (
                    (f"{fault} too long", "a shorter name")
                    if len(made) > NAME_LENGTH
                    else (f"{fault} not legal", NAME_RULE)
                )
            if made in others:
                fault = f"the controllers {name} and {others[made]} both make {_BARE[section]} {made}"
                return fault, "another name for one of them"
            for other, what in _BARE.items():
                if made in document.section(other):
                    fault = f"the controller makes {_BARE[section]} {made}, and there is {what} of that name"
                    return fault, "another name for one of them"
    return "", ""


def _check_task_frames(document: Document, reading: Reading) -> None:
    """Report task frames that are neither bodies nor frames."""
    known = [name for key in ("bodies", "beams", "frames") for name in document.section(key)]
    known += sorted(name for key in ("bodies", "beams", "frames") for name in reading.refused[key])
    for place, name in enumerate(document.task_frames):
        check_reference(f"task_frames[{place}]", name, known, "body or frame", reading.report)


def _check_frames_of_elements(document: Document, reading: Reading) -> None:
    """Report force elements between two frames of one rigid body."""
    tree, beams = reading.kept(Tree), document.section("beams")
    for element in _elements(reading):
        frames = element.frames()
        if tree.complete and frames is not None:
            check_two_bodies(element.section, element.name, *frames, tree.joints, beams, reading.report)


def _check_places(document: Document, reading: Reading) -> None:
    """Report attachments to a beam beyond its ends."""
    items = reading.items
    check_places(
        items["bodies"],
        items["joints"].values(),
        {**items["points"], **items["frames"]}.values(),
        _elements(reading),
        items["constraints"].values(),
        reading.values,
    )


def _elements(reading: Reading) -> list[ForceElement]:
    rows = [row for row in reading.rows if isinstance(row, ElementSection)]
    return [element for row in rows for element in reading.items[row.key].values()]


def _check_groups(document: Document, reading: Reading) -> None:
    """Report the groups of bodies that do not move on their own."""
    for joint in document.section("joints").values():
        body = document.section("bodies").get(joint.child)
        if not JOINTS[joint.type].moves and body is not None and body.group is not None:
            what = f"the body {joint.child} has no motion of its own: a fixed joint carries it"
            reading.report.add(key_of("bodies", joint.child, "group"), what, "the group of the body that carries it")


def _check_drive_efforts(document: Document, reading: Reading) -> None:
    """Report efforts of drives that do not exist, or whose name two drives have."""
    items, report = reading.items, reading.report
    driven = [joint.name for joint in items["joints"].values() if joint.drive]
    driven += [item.name for item in items["constraints"].values() if item.prescribed is not None]
    outputs, events = items["outputs"].values(), items["events"].values()
    formulas = [(key_of("outputs", item.name), value) for item in outputs for value in item.values]
    formulas += [(key_of("events", item.name), value) for item in events for value in (item.when, *item.actions())]
    for key, formula in formulas:
        for symbol in sorted(symbols(formula), key=lambda symbol: symbol.name):
            if symbol.kind == "drive_effort" and (count := driven.count(symbol.name)) != 1:
                what = f"{symbol.name} has no drive" if not count else f"two drives are called {symbol.name}"
                hint = nearest(symbol.name, driven) or 'drive = "0.5 * t"'
                report.add(key, f"drive_effort.{symbol.name}: {what}", hint if not count else "another name")


def _check_simulation(document: Document, reading: Reading) -> None:
    """Report a time grid or a spectral radius that cannot be."""
    simulation, report = document.simulation, reading.report
    if not is_legal(simulation.method):
        report.add("simulation.method", f"{shown(simulation.method)} is not the name of a method", "generalized_alpha")
    if simulation.step <= 0.0:
        report.add("simulation.step", f"the step {simulation.step:.6g} is not positive", "1e-3")
    if simulation.duration < 0.0:
        report.add("simulation.duration", f"the duration {simulation.duration:.6g} is negative", "0 or more")
    if not 0.0 <= simulation.rho_inf <= 1.0:
        report.add("simulation.rho_inf", f"rho_inf {simulation.rho_inf:.6g} is not between 0 and 1", "0.8")
    if "rho_inf" in simulation.model_fields_set and simulation.alpha is not None:
        report.add(
            "simulation.alpha", "alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha)", "one of them"
        )


def unused_names(document: Document, values: Values) -> list[str]:
    """Return a note on the parameters, one on the inputs, one on the curves, one on the random processes, one on
    the waves, and one on each mode and controller, that no formula mentions."""
    notes = []
    mentioned = values.mentioned
    random = document.section("random")
    by_parameters = {name for name in values.names.motions if ("parameter", motion_parameters(name)[0]) in mentioned}
    by_parameters |= {name for name in random if ("parameter", variables_of(name, 1)[0]) in mentioned}
    for kind, what_it_is, plural, names in (
        ("parameter", "parameter", "parameters", document.section("parameters")),
        ("input", "input", "inputs", document.section("inputs")),
        ("curve", "curve", "curves", document.section("curves")),
        ("input", "random process", "random processes", random),
        ("waves", "sea", "seas", document.section("waves")),
    ):
        unused = [name for name in names if (kind, name) not in mentioned and name not in by_parameters]
        if unused:
            several = len(unused) > 1
            what = f"the {plural} {listed(unused)} change" if several else f"the {what_it_is} {unused[0]} changes"
            notes.append(f"{what} nothing: no formula mentions {'them' if several else 'it'}")
    for name in document.section("modes"):
        if ("parameter", mode_parameter(name)) not in values.mentioned:
            notes.append(f"the mode {name} changes nothing: no formula mentions it")
    read = {name for kind, name in values.mentioned if kind in ("controller", "state")}
    for name, controller in document.section("controllers").items():
        alone = {name: controller}
        if read.isdisjoint([*outputs_of_controllers(alone), *states_of_controllers(alone)]):
            notes.append(f"the controller {name} changes nothing: no formula mentions what it gives")
    return notes


def efforts_on_drives(document: Document) -> list[str]:
    """Return a note on each effort on a joint whose motion is prescribed by its drive."""
    return [
        f"{key_of('efforts', name)}: the joint {effort.joint} is driven, so the effort changes nothing of its motion,"
        f" only drive_effort.{effort.joint}"
        for name, effort in document.section("efforts").items()
        if effort.joint in document.section("joints") and document.section("joints")[effort.joint].drive is not None
    ]


#: Checks across sections, in their order: before sections are read that observe a motion, and at the end.
CHECKS: tuple[Callable[[Document, Reading], None], ...] = (
    _check_task_frames,
    lambda document, reading: check_controllers(reading),
    _check_frames_of_elements,
    _check_places,
    _check_groups,
)
LAST_CHECKS: tuple[Callable[[Document, Reading], None], ...] = (_check_drive_efforts, _check_simulation)
