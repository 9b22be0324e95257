"""Checks across the entries of a scene: names, task frames, places on beams, groups, efforts of drives, time grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import takewhile
from typing import TYPE_CHECKING, Any

from eomgen.base.data import replace
from eomgen.base.messages import NAME_RULE, is_legal, key_of, nearest, shown
from eomgen.base.products import import_target
from eomgen.errors import UsageError
from eomgen.formula.evaluate import symbols
from eomgen.formula.words import RESERVED
from eomgen.scene.control.controllers import check_loops
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.frames import check_two_bodies
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.section import Reading, Section
from eomgen.scene.signals.sections import CURVES
from eomgen.scene.tree.beam_attachments import check_places
from eomgen.scene.tree.sections import TreeSections
from eomgen.system.description import Simulation

if TYPE_CHECKING:
    from eomgen.scene.document.schema import SceneDocument


def check_names(document: SceneDocument, refused: Mapping[str, set[str]], report: Report) -> SceneDocument:
    """Return the document without the entries whose names are not legal; these names are reported, and added to the set
    of the section in ``refused``."""
    if not is_legal(document.name):
        report.add("name", f"the name {shown(document.name)} is not legal [E0715]", NAME_RULE)
    kept: dict[str, object] = {}
    rows = sorted(document.rows, key=lambda row: row is CURVES)  # names of curves count last
    for row in document.rows:
        if row.single:
            continue
        entries = document.section(row.key)
        for name in [*entries, *sorted(refused[row.key])]:
            fault, hint = _fault(row, name, document, rows)
            if fault:
                report.add(key_of(row.key, name), fault, hint)
                refused[row.key].add(name)
        if entries:
            kept[row.key] = {name: entry for name, entry in entries.items() if name not in refused[row.key]}
    return document.model_copy(update=kept)


def _fault(row: Section, name: str, document: SceneDocument, rows: Sequence[Section]) -> tuple[str, str]:
    """Return the fault of a name of an entry, and a hint; two empty texts if there is none."""
    if not is_legal(name):
        return f"the name {shown(name)} is not legal [E0715]", NAME_RULE
    if row.bare and name in RESERVED:
        return f"the name {name} is a word of formulas [E0729]", f"{name}_value"
    bare = [entry for entry in rows if entry.bare] if row.bare else []  # formulas use the names of all these entries
    for prior in takewhile(lambda section: section is not row, bare):
        if name in document.section(prior.key):
            return f"the name {name} is both {prior.bare} and {row.bare} [E1461]", "another name for one of them"
    return row.fault_of_name(name, document, rows)


def _check_task_frames(document: SceneDocument, reading: Reading) -> None:
    """Report task frames that are neither bodies nor frames."""
    names = [name for key in ("bodies", "beams", "frames") for name in document.section(key)]
    names += sorted(name for key in ("bodies", "beams", "frames") for name in reading.refused[key])
    for index, name in enumerate(document.task_frames):
        check_reference(f"task_frames[{index}]", name, names, "body or frame", reading.report)


def _check_loops(document: SceneDocument, reading: Reading) -> None:
    check_loops(reading.items["controllers"]["controllers"], _elements(reading), reading.values)


def _check_frames_of_elements(document: SceneDocument, reading: Reading) -> None:
    """Report force elements between two frames of one rigid body."""
    tree, elements = reading.kept(TreeSections), _elements(reading)
    framed = [(key_of(item.section, item.name), frames) for item in elements if (frames := item.frames()) is not None]
    if tree.complete:
        check_two_bodies(framed, tree.joints, document.section("beams"), reading.report)


def _elements(reading: Reading) -> list[ForceElement]:
    rows = [row for row in reading.rows if isinstance(row, ElementSection)]
    return [element for row in rows for element in reading.items[row.key].values()]


def _check_groups(document: SceneDocument, reading: Reading) -> None:
    """Report each body with the key ``group`` that a fixed joint carries, because only free bodies have a group."""
    for joint in document.section("joints").values():
        body = document.section("bodies").get(joint.child)
        if not JOINTS[joint.type].moves and body is not None and body.group is not None:
            fault = f"the body {joint.child} has no motion of its own: a fixed joint carries it [E1462]"
            reading.report.add(key_of("bodies", joint.child, "group"), fault, "the group of the body that carries it")


def _check_drive_efforts(document: SceneDocument, reading: Reading) -> None:
    """Report quantities ``drive_effort`` in formulas of outputs and events that name no drive, or a name of two
    drives."""
    items, report = reading.items, reading.report
    driven = [joint.name for joint in items["joints"].values() if joint.drive]
    driven += [item.name for item in items["constraints"].values() if item.has_effort]
    outputs, events = items["outputs"].values(), items["events"].values()
    formulas = [(key_of("outputs", item.name), value) for item in outputs for value in item.values]
    formulas += [(key_of("events", item.name), value) for item in events for value in (item.when, *item.actions())]
    for key, formula in formulas:
        for symbol in sorted(symbols(formula), key=lambda symbol: symbol.name):
            if symbol.kind == "drive_effort" and (count := driven.count(symbol.name)) != 1:
                fault, hint = f"two drives are called {symbol.name} [E1464]", "another name"
                if not count:
                    fault = f"{symbol.name} has no drive [E1463]"
                    hint = nearest(symbol.name, driven) or 'drive = "0.5 * t"'
                report.add(key, f"drive_effort.{symbol.name}: {fault}", hint)


def _check_simulation(document: SceneDocument, reading: Reading) -> None:
    """Report values of the table ``simulation`` out of range: method's name, step, duration and ``rho_inf``, and
    ``rho_inf`` next to ``alpha``."""
    simulation, report = document.simulation, reading.report
    if simulation.method not in (Simulation.method, "auto"):  # few scenes choose a method
        canonical_name: Any = import_target("eomgen.integrators.families.register:canonical_name")
        try:
            canonical_name(simulation.method)
        except UsageError as error:
            where = report.where("simulation.method")
            report.add_problem("simulation.method", replace(error.problems[0], where=where))
    if simulation.step <= 0.0:
        report.add("simulation.step", f"the step {simulation.step:.6g} is not positive [E1466]", "1e-3")
    if simulation.duration < 0.0:
        report.add("simulation.duration", f"the duration {simulation.duration:.6g} is negative [E1467]", "0 or more")
    if not 0.0 <= simulation.rho_inf <= 1.0:
        report.add("simulation.rho_inf", f"rho_inf {simulation.rho_inf:.6g} is not between 0 and 1 [E1468]", "0.8")
    if "rho_inf" in simulation.model_fields_set and simulation.alpha is not None:
        fault = "alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha) [E0352]"
        report.add("simulation.alpha", fault, "one of them")


#: Checks across sections, in order: before sections are read that observe a motion, and at the end.
CHECKS: tuple[Callable[[SceneDocument, Reading], None], ...] = (
    _check_task_frames,
    _check_loops,
    _check_frames_of_elements,
    lambda document, reading: check_places(reading.items, _elements(reading), reading.values),
    _check_groups,
)
LAST_CHECKS: tuple[Callable[[SceneDocument, Reading], None], ...] = (_check_drive_efforts, _check_simulation)
