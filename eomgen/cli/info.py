"""``eomgen info``: requirements of a scene, simplifications, and the cost of each function; products add parts by rows
of the group ``eomgen.info``.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.data import dataclass
from eomgen.base.messages import counted
from eomgen.base.products import rows_of
from eomgen.cli.options import debug_option, json_option, scene_options, terms_option
from eomgen.cli.printing import console, number_list, print_json, print_table

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene
    from eomgen.system.system import Discontinuity, System


GROUP = "eomgen.info"


@dataclass(frozen=True)
class InfoPart:
    """A part that a product adds to the information about a scene.

    Attributes
    ----------
    describe : returns the data of the part, as JSON types by key
    show : prints the data of the part
    hidden : returns the parameters in these data that the table of parameters leaves out
    """

    describe: Callable[[Scene], Mapping[str, Any]]
    show: Callable[[Mapping[str, Any]], None]
    hidden: Callable[[Mapping[str, Any]], Iterable[str]]


@click.command()
@terms_option
@click.option("--method", default=None, metavar="NAME", help="Whose step is counted, operation by operation.")
@click.option(
    "--base-parameters",
    is_flag=True,
    help="Show which combinations of masses, inertias and friction decide inverse dynamics (compiles the regressor).",
)
@scene_options
@json_option
@debug_option
def info(
    scene: str,
    terms: list[str] | None,
    method: str | None,
    base_parameters: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Show degrees of freedom, groups, kept and dropped terms, and exact operation counts of a SCENE."""
    from eomgen.mechanics.savings import savings  # noqa: PLC0415  # SymPy comes with it
    from eomgen.pipeline.documents import load_scene  # noqa: PLC0415
    from eomgen.pipeline.front_end import file_kinds  # noqa: PLC0415
    from eomgen.pipeline.methods import method_of  # noqa: PLC0415
    from eomgen.pipeline.pipeline import derive  # noqa: PLC0415
    from eomgen.pipeline.step_operations import joined_coordinates, operations_of_step  # noqa: PLC0415

    options = {**reading, "terms": terms, "base_parameters": base_parameters}
    if any(kind.show(scene, method, options, as_json) for kind in file_kinds()):
        return
    described_scene = load_scene(scene, **reading)
    system = derive(described_scene, terms)
    data = {**describe_system(system), "joined": joined_coordinates(system)}
    data["notes"] += [note for note in described_scene.notes if note not in data["notes"]]  # on shapes, too
    data["repeated"] = dict(described_scene.metadata.get("repeat", {}))
    data["calibrated"] = [name for item in described_scene.feedback for name in item.calibrated_parameters]
    if method is not None:
        data["step"] = operations_of_step(described_scene, method_of(described_scene, method))
    data["equations"] = {item.name: item.text for item in described_scene.constraints if item.equation is not None}
    if base_parameters:
        data["base_parameters"] = _base_parameters(described_scene)
    data["savings"] = [dataclasses.asdict(saving) for saving in savings(described_scene)]
    data["definitions"] = [
        {"name": item.name, "formula": item.text, "unit": item.unit, "description": item.description}
        for item in described_scene.parts.get("definitions", ())
    ]
    data["places"] = [design_place._asdict() for design_place in described_scene.design_places()]
    base = described_scene.base
    data["base_moves"] = base is not None
    data["integrals"] = [] if base is None else list(base.integrals.values())
    for part in rows_of(GROUP, InfoPart):
        data |= part.describe(described_scene)
    if as_json:
        print_json(data)
    else:
        _print(data)


def describe_system(system: System) -> dict[str, Any]:
    """Return sizes, groups, names, facts, operation counts and notes of a System for ``info``, JSON types by key."""
    counts = {name: {**dataclasses.asdict(count), "flops": count.flops} for name, count in system.counts.items()}
    return {
        "scene": system.name,
        "description": system.description,
        "sizes": {"nq": system.nq, "nv": system.nv, "nu": system.nu, "nz": system.nz, "bodies": len(system.bodies)},
        "degrees_of_freedom": system.nv - len(system.multipliers),
        "constraints": list(system.multipliers),
        "multiplier_units": ["N m" if unit.startswith("1") else "N" for unit in system.row_units],
        "groups": [
            {"joint": factor.name, "group": factor.group, "nq": factor.q_size, "nv": factor.v_size}
            for factor in system.factors
        ],
        "angles": list(system.angles),
        "parameters": {item.name: item.value for item in system.parameters},
        "parameter_units": {item.name: item.unit for item in system.parameters},
        "inputs": [item.name for item in system.inputs],
        "states": _states(system),
        "outputs": [item.name for item in system.outputs],
        "modes": {mode.name: system.parameters[mode.parameter].value for mode in system.modes},
        "events": [
            {"name": row.name, "direction": _DIRECTIONS[row.sign], "action": row.action, "description": row.description}
            for row in system.events
        ],
        "facts": dataclasses.asdict(system.facts),
        "functions": {
            name: {
                "description": function.description,
                "inputs": list(function.inputs),
                "counts": counts[name],
                "critical_path": system.critical_paths[name],
            }
            for name, function in system.functions.items()
        },
        "curves": [line.removeprefix("curve ") for line in system.kept if line.startswith("curve ")],
        "jumps": _jumps(system.discontinuities),
        "kept": list(system.kept),
        "dropped": list(system.dropped),
        "notes": list(system.notes),
    }


def _base_parameters(scene: Scene) -> dict[str, Any]:
    """Return the base parameters of a scene as JSON types: number ``of``, ``combinations``, ``without_effect``."""
    from eomgen.pipeline.pipeline import build  # noqa: PLC0415

    result = build(scene, ["inverse_dynamics", "regressor", "regressor_parameters"]).base_parameters()
    listed = zip(result.expressions, result.values.tolist(), result.units, strict=True)
    combinations = [{"combination": text, "value": value, "unit": unit} for text, value, unit in listed]
    return {"of": len(result.parameters), "combinations": combinations, "without_effect": list(result.without_effect)}


#: Number of names that differ in numbers alone, from which on the first and the last name stand for all.
_MANY = 12
#: Operations of a step, as ``operations_of_step`` names them.
OPERATIONS = ("additions", "multiplications", "divisions", "functions")
_DIRECTIONS = {1: "rising", -1: "falling", 0: "both"}


def _jumps(discontinuities: Sequence[Discontinuity]) -> list[str]:
    """Return the first known times of jumps in words, 8 at most, and the number of further ones."""
    does = ("forces jump", "rates of forces jump")
    lines = [
        f"t = {item.time:.9g} s{f' and every {item.period:.9g} s' if item.period else ''}: "
        + (does[item.order] if item.order < len(does) else f"derivatives of order {item.order} jump")
        for item in discontinuities[:8]
    ]
    more = len(discontinuities) - len(lines)
    return [*lines, f"and {more} more"] if more else lines


def _states(system: System) -> list[dict[str, Any]]:
    """Return the internal states as JSON types, with ``flops`` of the rate of each, None without rates."""
    rates = system.functions["internal_rate"].refs if "internal_rate" in system.functions else [None] * system.nz
    return [
        {
            "name": state.name,
            "initial": state.value,
            "unit": state.unit,
            "description": state.description,
            "flops": None if ref is None else system.tape.counts([ref]).flops,
        }
        for state, ref in zip(system.states, rates, strict=True)
    ]


def _print(data: dict[str, Any]) -> None:
    """Print all tables of ``eomgen info``."""
    products = rows_of(GROUP, InfoPart)
    hidden = {name for part in products for name in part.hidden(data)}
    _print_summary(data)
    _print_configuration(data)
    _print_parameters(data, hidden)
    header = ("name", "formula", "unit", "description")
    _print_rows("Definitions", header, [[item[key] for key in header] for item in data["definitions"]])
    for part in products:
        part.show(data)
    _print_states(data["states"])
    header = ("name", "direction", "action", "description")
    _print_rows("Events", header, [[event[key] for key in header] for event in data["events"]])
    _print_operations(data["functions"])
    if "step" in data:
        _print_step(data["step"])
    if "base_parameters" in data:
        _print_base_parameters(data["base_parameters"])
    _print_savings(data)
    _print_lists(data)


def _print_summary(data: dict[str, Any]) -> None:
    """Print the name with sizes, the description and repeated groups."""
    out, sizes, rows = console(), data["sizes"], data["constraints"]
    rest = f"{counted(sizes['bodies'], 'body', 'bodies')}, {counted(sizes['nu'], 'input')}"
    freedom = counted(data["degrees_of_freedom"], "degree of freedom", "degrees of freedom")
    if rows:
        freedom = f"{counted(sizes['nv'], 'velocity', 'velocities')}, {counted(len(rows), 'constraint row')}, {freedom}"
        rest = f"if the rows are independent; {rest}"
    out.print(f"[bold]{data['scene']}[/]: {freedom}{' ' if rows else ', '}{rest}")
    if data["description"]:
        out.print(data["description"], markup=False)
    if data["repeated"]:
        times = ", ".join(f"{name} {counted(count, 'time')}" for name, count in data["repeated"].items())
        out.print(f"Repeated: {times}", markup=False)


def _print_configuration(data: dict[str, Any]) -> None:
    """Print the groups of the configuration, constraint rows and places."""
    groups: dict[str, list[str]] = {}
    for factor in data["groups"]:
        groups.setdefault(factor["group"], []).append(factor["joint"])
    if data["angles"]:
        groups["over turns"] = data["angles"]
    joined = [(group, len(names), ", ".join(_join_runs(names))) for group, names in groups.items()]
    _print_rows("Configuration", ("group", "joints", "names"), joined, (1,))
    _print_rows("Constraint rows", ("constraint", "rows", "meaning"), _by_constraint(data), (1,))
    if data["places"]:
        console().print()
        _print_places(data["places"], "base" if data["base_moves"] else "world")


def _print_rows(
    title: str, header: Sequence[str], rows: Sequence[Sequence[object]], numeric: Sequence[int] = ()
) -> None:
    """Print an empty line and a table, unless the table has no rows."""
    if rows:
        console().print()
        print_table(title, header, rows, numeric=numeric)


def _print_parameters(data: dict[str, Any], hidden: Collection[str]) -> None:
    """Print the tunable parameters without the parameters that a product shows."""
    units = data["parameter_units"]
    later = dict.fromkeys(data["calibrated"], "calibrated")  # when the model is built
    values = [
        (name, later.get(name, f"{value:.9g}"), units[name])
        for name, value in data["parameters"].items()
        if name not in hidden
    ]
    _print_rows("Tunable parameters", ("name", "value", "unit"), values, (1,))


def _print_states(states: Sequence[Mapping[str, Any]]) -> None:
    rows = [(s["name"], f"{s['initial']:.9g}", s["unit"], "" if s["flops"] is None else s["flops"]) for s in states]
    _print_rows("Internal states", ("name", "initial", "unit", "flops of its rate"), rows, (1, 3))


def _print_operations(functions: Mapping[str, Any]) -> None:
    """Print the operations of each function."""
    keys = ("additions", "multiplications", "divisions", "functions", "selections", "flops")
    rows = [(name, *(item["counts"][key] for key in keys), item["critical_path"]) for name, item in functions.items()]
    header = ("function", "+", "*", "/", "sin, sqrt ...", "selections", "flops", "critical path")
    _print_rows("Exact operation counts, and cycles of the critical path", header, rows, range(1, 8))


def _print_step(step: Mapping[str, Any]) -> None:
    """Print the operations of a step of a method."""
    parts = [(row["what"], row["times"], *(row[key] for key in OPERATIONS)) for row in step["parts"]]
    parts.append(("all of it", 1, *(step["total"][key] for key in OPERATIONS)))
    title = f"A step of {step['method']}: {step['total']['flops']} flops, the same every time"
    _print_rows(title, ("part", "times", "+", "*", "/", "sin, sqrt ..."), parts, range(1, 6))


def _print_base_parameters(base: Mapping[str, Any]) -> None:
    """Print the combinations of inertia parameters that the motion depends on."""
    rows = [(row["combination"], f"{row['value']:.6g}", row["unit"]) for row in base["combinations"]]
    _print_rows(
        f"Base parameters: {len(rows)} combinations of {base['of']}", ("combination", "value", "unit"), rows, (1,)
    )
    console().print(f"Without effect: {', '.join(base['without_effect']) or 'none'}", markup=False)


def _print_savings(data: dict[str, Any]) -> None:
    """Print springs that methods eliminate, and the operations that simplifications save."""
    out = console()
    for names in data["joined"]:
        out.print()
        who = "rosenbrock, lsrt2, corrected_predictor and the tdg methods eliminate them without subtraction"
        out.print(f"Relative springs join {', '.join(names)}: {who}", markup=False)
    rows = [(item["what"], item["term"], item["operations"], item["without"]) for item in data["savings"]]
    header = ("because of", "function", "flops", "flops without it")
    _print_rows("Savings of simplifications", header, rows, (2, 3))


def _print_lists(data: dict[str, Any]) -> None:
    """Print curves, known times of jumps, elements left out and notes."""
    out = console()
    titles = {
        "curves": "Curves, arguments and values in SI units", "integrals": "Accelerations of the base",
        "jumps": "Known times at which forces jump or bend",
        "dropped": "Left out", "notes": "Notes",
    }  # fmt: skip  # a table
    for key, title in titles.items():
        if data[key]:
            out.print()
            out.print(f"[italic]{title}[/]")
            for line in data[key]:
                out.print(f"  {line}", markup=False)


def _print_places(places: Sequence[Mapping[str, Any]], fixed: str) -> None:
    """Print a table of joints, points and frames at the design position.

    Parameters
    ----------
    places : entries of ``design_places``
    fixed : name of the frame that carries the tree, ``base`` or ``world``
    """
    lines = [
        (entry["name"], entry["body"], *(number_list(entry[key]) for key in ("position", "world"))) for entry in places
    ]
    title = "Places at the design position, every joint at zero"
    print_table(title, ("place", "body", "in the body, m", f"in the {fixed}, m"), lines)


def _by_constraint(data: Mapping[str, Any]) -> list[tuple[str, int, str]]:
    """Return each constraint with the number and the meanings of the rows, which are named ``constraint: meaning``."""
    groups: dict[str, list[str]] = {}
    for row, unit in zip(data["constraints"], data["multiplier_units"], strict=True):
        name, _, meaning = row.partition(": ")
        if name in data["equations"]:
            meaning = f"{data['equations'][name][:80]} = 0, multiplier in {unit}"
        groups.setdefault(name, []).append(meaning)
    return [(name, len(meanings), ", ".join(_join_runs(meanings))) for name, meanings in groups.items()]


def _join_runs(names: Sequence[str]) -> list[str]:
    """Return names, with ``_MANY`` or more that differ in numbers alone as the first and the last: ``rope.1 to
    rope.40``."""
    alike: dict[str, list[str]] = {}
    for name in names:
        alike.setdefault(re.sub(r"\d+", "0", name), []).append(name)
    joined = [[f"{run[0]} to {run[-1]}"] if len(run) >= _MANY else run for run in alike.values()]
    return list(itertools.chain(*joined)) if max(map(len, alike.values()), default=0) >= _MANY else list(names)
