"""The rooms of the package open downwards only, and SymPy stays out of the way from a cached build to a running
model."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from enum import Enum, auto
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import eomgen

PACKAGE = Path(eomgen.__file__).parent

#: Rooms beside the core, and identifiers of theirs that the core must not use.
PRODUCTS = {
    *("ensembles", "fields", "hamiltonian", "random_processes", "reliability", "sampling", "sea_states", "studies"),
    "waves",
}
PRODUCT_WORDS: dict[str, set[str]] = {
    "studies": {
        *("compared", "contender", "facts_of", "fine_by", "identification", "ladder", "ladders", "method_facts"),
        *("policies", "policy", "studied", "tuning", "vibration", "work_precision"),
    },
    "ensembles": {"ensembles"},
    "reliability": {"importance_sampling", "reliability"},
    "random_processes": {"karhunen_loeve"},
    "fields": {"posterior"},
}

#: For each room: the other rooms that it may import, or the one module of a room. Every room is here.
DOORS: dict[str, set[str]] = {
    # what every room may need
    "version": set(),
    "arrays": set(),
    "errors": set(),
    "text": set(),
    "threads": {"errors"},
    "attributes_elsewhere": set(),
    "calls": {"attributes_elsewhere", "errors", "system.terms", "text", "verbs"},
    "extensions": {"errors", "text"},
    "verbs": {"errors", "extensions", "text"},
    "files": {"arrays", "errors", "text"},
    "resources": {"errors"},
    "figures": {"errors"},
    "html": set(),
    "locks": set(),
    "progress": {"errors"},
    "random_roads": {"road_classes"},
    "random_processes": {"arrays", "errors", "formula", "road_classes", "solvers.quadrature"},
    "road_classes": set(),
    "study_defaults": set(),
    "spectra": {"arrays", "calls", "errors", "figures", "html", "road_classes", "text", "units"},
    # arrays and C alone
    "toolchain": {"errors", "locks"},
    "control": {"arrays", "calls", "errors", "figures", "html", "linear", "road_classes", "text"},
    "solvers": {"arrays", "errors", "lie"},
    "linear": {
        "arrays",
        "calls",
        "errors",
        "figures",
        "html",
        "lie",
        "progress",
        "road_classes",
        "spectra",
        "text",
        "units",
    },
    # from a description to C
    "symbolic": set(),
    "lie": {"symbolic"},
    "formula": {"arrays", "errors", "symbolic"},
    "units": {"errors", "formula.words", "text"},
    "system": {"arrays", "calls", "errors", "formula", "html", "lie", "symbolic", "text"},
    "scene": {
        "arrays",
        "calls",
        "errors",
        "extensions",
        "files",
        "formula",
        "html",
        "lie",
        "random_processes",
        "random_roads",
        "sea_states",
        "system",
        "text",
        "units",
    },
    "mechanics": {"arrays", "errors", "formula", "lie", "scene", "symbolic", "system", "text"},
    "integrators": {"arrays", "errors", "extensions", "lie", "symbolic", "system", "text"},
    "codegen": {"errors", "extensions", "files", "integrators", "resources", "symbolic", "system", "text", "version"},
    "hamiltonian": {
        "arrays",
        "calls",
        "codegen",
        "errors",
        "figures",
        "files",
        "formula",
        "integrators",
        "lie",
        "scene",
        "symbolic",
        "system",
        "text",
        "toolchain",
    },
    "fields": {
        "arrays",
        "calls",
        "codegen",
        "errors",
        "files",
        "formula",
        "integrators.compositions",
        "scene",
        "symbolic",
        "text",
        "threads",
        "toolchain",
    },
    "sampling": {"arrays", "errors", "fields", "figures", "files", "formula", "progress", "scene", "text"},
    # a compiled model, and what it can do
    "compiled": {
        "arrays",
        "calls",
        "errors",
        "formula",
        "html",
        "lie",
        "solvers",
        "system",
        "text",
        "threads",
        "toolchain",
        "units",
    },
    "results": {
        "arrays",
        "calls",
        "compiled",
        "errors",
        "figures",
        "files",
        "formula",
        "html",
        "lie",
        "linear",
        "resources",
        "spectra",
        "system",
        "text",
    },
    "analysis": {
        "arrays",
        "compiled",
        "errors",
        "figures",
        "files",
        "formula",
        "lie",
        "linear",
        "progress",
        "solvers",
        "spectra",
        "system",
        "text",
    },
    "simulation": {
        "analysis",
        "arrays",
        "calls",
        "codegen.metadata",
        "compiled",
        "errors",
        "files",
        "formula",
        "integrators",
        "lie",
        "linear",
        "progress",
        "resources",
        "results",
        "system",
        "text",
        "toolchain",
        "version",
    },
    "ensembles": {
        "arrays",
        "calls",
        "compiled",
        "errors",
        "figures",
        "files",
        "locks",
        "progress",
        "random_processes",
        "random_roads",
        "results",
        "simulation",
        "system",
        "text",
        "threads",
        "units",
        "version",
    },
    "model": {"analysis", "calls", "compiled", "ensembles", "errors", "simulation", "verbs"},
    "reliability": {"arrays", "errors", "solvers.quadrature"},
    "sea_states": {"arrays", "calls", "errors", "random_processes"},
    "waves": {
        "arrays",
        "calls",
        "codegen",
        "errors",
        "integrators.compositions",
        "sea_states",
        "symbolic",
        "toolchain",
    },
    # verbs
    "pipeline": {
        "arrays",
        "calls",
        "codegen",
        "compiled",
        "control",
        "errors",
        "extensions",
        "formula",
        "hamiltonian",
        "integrators",
        "linear",
        "mechanics",
        "model",
        "scene",
        "solvers",
        "symbolic",
        "system",
        "text",
        "toolchain",
        "version",
    },
    "studies": {
        "analysis",
        "arrays",
        "calls",
        "compiled",
        "ensembles",
        "errors",
        "extensions",
        "figures",
        "files",
        "formula",
        "integrators",
        "lie",
        "model",
        "pipeline",
        "reliability",
        "results",
        "scene",
        "simulation",
        "study_defaults",
        "symbolic",
        "system",
        "text",
        "toolchain",
        "version",
    },
    "cli": {
        "analysis",
        "ensembles",
        "errors",
        "extensions",
        "files",
        "hamiltonian",
        "integrators.compositions",
        "linear",
        "mechanics",
        "model",
        "pipeline",
        "progress",
        "results",
        "road_classes",
        "sampling",
        "scene",
        "simulation",
        "spectra",
        "studies",
        "system",
        "text",
        "toolchain",
        "units",
        "verbs",
        "version",
    },
    "__main__": {"cli"},
}

#: For rooms with an inner order: their parts, each of which imports only from parts of lines before its own.
ORDER: dict[str, tuple[str, ...]] = {
    "scene": (
        "geometry joint_types",
        "formula",
        "reading",
        "section",
        "signals",
        "random",
        "waves",
        "bodies",
        "joints",
        "forces",
        "control digest display events tree",
        "scene sections sources",
        "document",
        "includes scaling",
        "hamiltonian",
        "load",
        "builder_methods",
        "builder_keys",
        "builder",
    ),
    "mechanics": (
        "linear_parameters",
        "describe extent laws shape_functions",
        "discontinuities tree",
        "beam_axes kinematics overshoots summary",
        "forces",
        "constants constraints dynamics rates",
        "reactions",
        "derivation",
        "initial_coordinates terms",
        "derive",
        "savings",
    ),
    "codegen": (
        "program",
        "folder metadata scheduling",
        "series targets",
        "convert lanes",
    ),
    "symbolic": (
        "operations",
        "tape",
        "map periodic scalar",
        "calculus evaluate harmonics kernel rotation series",
        "reading symbolic_kernel",
    ),
    "integrators": (
        "compositions harmonics newton step_splitting",
        "step_work",
        "families",
        "events methods samples stepper_layout",
        "stepper_data",
    ),
    "simulation": (
        "stepping",
        "accuracy",
        "judgement",
        "automatic_method checkpoint motions option_types row_times run_metadata simulator_state timing",
        "run_model",
        "outcome recorded_motion side_by_side",
        "bounded_steps",
        "resume sensitivities simulate simulator",
        "start",
    ),
    "simulation.sensitivities": (
        "equations functionals motion routines turning undefined_derivatives",
        "following_start galerkin_sweeps linear_steps",
        "galerkin_steps",
        "beginning step_matrices",
        "linear_run",
        "alpha_run crossings galerkin_run",
        "second_beginning",
        "galerkin_second_order input_derivatives second_order stationary_run",
        "run_sensitivities",
        "linearise",
    ),
    "studies.tuning": (
        "contender demand nearby_conditions scene_text",
        "judge",
        "verification_runs",
        "race real_time result",
        "entries",
        "tune",
    ),
    "studies.ladders": (
        "runs",
        "subject verdicts",
        "references register structure",
        "plots",
        "result",
        "study",
    ),
    "studies.work_precision": (
        "common_start configuration fidelity machine observation",
        "formulations",
        "axes running",
        "measured reference times",
        "journal plots",
        "result",
        "study",
    ),
    "studies.identification": (
        "combinations measurements",
        "estimation experiment findings",
        "plots unknowns",
        "result",
        "arguments judgement",
        "torques",
        "study",
    ),
    "fields": (
        "diagnostics mesh",
        "cells operators record transforms",
        "posterior",
        "sampling",
    ),
    "sampling": ("problem", "result", "plots run"),
    "waves": (
        "derivation derived motion",
        "pairs",
        "limits profiles routines",
        "sea",
        "radar statistics stepping",
    ),
    "studies.savings": (
        "variants",
        "study",
    ),
    "studies.verification": (
        "engines",
        "claims",
        "differences states tolerances",
        "form_report kinks",
        "plots verdict",
        "report",
        "check",
    ),
}

#: Imports within functions, by importing room or module: what is imported, and why it waits. No others are allowed.
LATE: dict[str, dict[str, str]] = {
    "__main__": {"cli": "Ctrl-C while it is imported leaves no traceback"},
    "solvers.consistency": {"solvers.strain_energy": "SciPy; few loops strain their beams"},
    "eomgen": {"calls": "for a mistake only"},
    "integrators.families.generalized_alpha": {
        "integrators.newton": "pivots are chosen when code is made",
        "integrators.harmonics": "inputs are looked at when code is made",
    },
    "integrators.families.rattlie": {"integrators.newton": "pivots are chosen when code is made"},
    "integrators.families.one_factorization": {"integrators.newton": "pivots are chosen when code is made"},
    "integrators.families.rosenbrock": {"integrators.step_work": "operations are counted on request"},
    "integrators.families.corrected_predictor": {"integrators.step_work": "operations are counted on request"},
    "integrators.families.discontinuous_galerkin": {"integrators.step_work": "operations are counted on request"},
    "cli": {"": "a command imports what it needs when its arguments are known to be fine"},
    "ensembles.cluster": {"ensembles.worker": "distributed, an optional package, for those who ask for a cluster"},
    "ensembles.ensemble": {"ensembles.plots": "matplotlib; an ensemble is used without it"},
    "mechanics.tree.beam_links": {"mechanics.shape_functions": "SciPy and mpmath; most scenes have no beams"},
    "mechanics.forces.distributed_loads": {"mechanics.shape_functions": "SciPy and mpmath; as above"},
    "pipeline.scenes": {
        "mechanics": "SymPy; a cached model needs none of it",
        "pipeline": "SciPy; a cached model needs none of it",
    },
    "hamiltonian.model": {
        "codegen.metadata": "a cached model needs no Jinja",
        "hamiltonian.code": "a cached model needs no Jinja",
    },
    "pipeline.hamiltonians": {
        "codegen.folder": "a model is built without it",
        "hamiltonian": "most scenes are mechanical",
        "scene.hamiltonian.reading": "most scenes are mechanical",
        "scene.hamiltonian.field_reading": "most scenes are mechanical",
        "toolchain.builder": "reading needs no compiler",
    },
    "pipeline.content": {"integrators.families": "methods are looked up with the library; loading a scene needs none"},
    "pipeline.pipeline": {
        "": "each stage is imported when it is reached: a cached model needs no SymPy, no Jinja and no SciPy",
    },
    "results.solution": {"results.animation": "solutions are used without it"},
    "scene.document.column_units": {"units.conversion": "Pint; most scenes have no units of their own"},
    "scene.reading.values": {"units.conversion": "Pint; few curves say the unit of their argument"},
    "scene.document.units": {"units.conversion": "Pint; most scenes have no units of their own"},
    "scene.scaling": {"units.conversion": "Pint; studies of other sizes alone change units"},
    "scene.signals.curves": {"units.conversion": "Pint; most scenes have no units of their own"},
    "scene.signals.output_units": {"units.conversion": "Pint; most outputs have the unit of their kind"},
    "units.labels": {"units.conversion": "Pint; most scenes have no units of their own"},
    "scene.load": {
        "scene.document": "pydantic is slow to import, and the cached path of a made Scene needs none",
        "scene.hamiltonian": "for a mistake only",
        "scene.includes": "most scenes include nothing",
    },
    "scene.sources.text": {"files": "for a mistake only"},
    "scene.sources.urdf.source": {"scene.sources.urdf.conversion": "most scenes are no URDF"},
    "studies.ladders.result": {"studies.ladders.plots": "matplotlib; a map is used without it"},
    "studies.identification.result": {"studies.identification.plots": "matplotlib; a study is used without it"},
    "studies.vibration.result": {"studies.vibration.plots": "matplotlib; a study is used without it"},
    "studies.work_precision.result": {"studies.work_precision.plots": "matplotlib; a study is used without it"},
    "simulation.stepping.settings": {
        "formula.jumps": "it evaluates on the tape; most scenes prescribe no motion",
        "formula.steepness": "likewise",
        "formula.undefined_laws": "likewise",
    },
    "simulation.stepping.start_state": {"analysis.equilibrium": "SciPy; most runs do not start from equilibrium"},
    "simulation.run_model": {"analysis.linearize": "SciPy; only linear models about motions need it"},
    "system.system": {"symbolic.reading": "SymPy; only for reading a term"},
}
SYMPY_ROOMS = {"symbolic", "mechanics", "lie", "waves"}
NO_PICKLE_NO_EVAL = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}


class Kind(Enum):
    """When an import happens: with its module, within a function, or for type checkers only."""

    TOP = auto()
    LATE = auto()
    TYPING = auto()


@cache
def _modules() -> tuple[tuple[str, Path], ...]:
    found = []
    for path in sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found.append((".".join(parts[:-1] if parts[-1] == "__init__" else parts), path))
    return tuple(found)


@cache
def _imports(path: Path) -> tuple[tuple[str, Kind], ...]:
    """Return every imported module, and when it is imported."""
    kinds: dict[ast.AST, Kind] = {}

    def walk(node: ast.AST, kind: Kind) -> None:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            kind = Kind.TYPING
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kind = Kind.LATE
        elif isinstance(node, ast.Import | ast.ImportFrom):
            kinds[node] = kind
        for child in ast.iter_child_nodes(node):
            walk(child, kind)

    walk(ast.parse(path.read_text(encoding="utf-8")), Kind.TOP)
    found = []
    for node, kind in kinds.items():
        if isinstance(node, ast.Import):
            found += [(alias.name, kind) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide which door is used"
            module = node.module or ""
            submodules = [f"{module}.{alias.name}" for alias in node.names]
            found += [(name if _is_module(name) else module, kind) for name in submodules]
    return tuple(dict.fromkeys(found))


@cache
def _is_module(name: str) -> bool:
    path = PACKAGE.parent.joinpath(*name.split("."))
    return any(path.with_suffix(ending).is_file() for ending in (".py", ".pyi")) or path.is_dir()


def _own() -> Iterator[tuple[str, str, Kind]]:
    """Yield importing module, imported module and kind of all imports within the package, names without ``eomgen.``."""
    for module, path in _modules():
        for name, kind in _imports(path):
            if name.split(".")[0] == "eomgen":
                yield module, name.removeprefix("eomgen").removeprefix("."), kind


def _may(room: str, target: str) -> bool:
    return any(target == door or target.startswith(door + ".") for door in {room, *DOORS[room]})


def test_every_room_is_in_the_table() -> None:
    assert {module.split(".")[0] for module, _ in _modules()} - {""} == set(DOORS)


@pytest.mark.parametrize("room", DOORS)
def test_rooms_import_what_their_doors_allow(room: str) -> None:
    wrong = [
        f"{module} imports {name}"
        for module, name, _ in _own()
        if module.split(".")[0] == room and not _may(room, name)
    ]
    assert wrong == []


def _identifiers(path: Path) -> Iterator[str]:
    """Yield the names that code of a file uses or defines, and each part of the names that it imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = (getattr(node, key, None) for key in ("id", "arg", "attr", "name", "asname", "module"))
        yield from (part for name in names if isinstance(name, str) for part in name.split("."))


@pytest.mark.parametrize("product", PRODUCT_WORDS)
def test_core_rooms_do_not_use_words_of_a_product(product: str) -> None:
    rooms = set(DOORS) - PRODUCTS - {"model", "cli"}
    used = {
        f"{module}: {name}"
        for module, path in _modules()
        if module.split(".")[0] in rooms
        for name in _identifiers(path)
        if name in PRODUCT_WORDS[product]
    }
    assert used == set()


@pytest.mark.parametrize("product", PRODUCT_WORDS)
def test_words_of_a_product_are_in_use_there(product: str) -> None:
    files = [path for module, path in _modules() if module.split(".")[0] == product]
    assert set(PRODUCT_WORDS[product]) <= {name for path in files for name in _identifiers(path)}


def test_no_door_is_open_for_nobody() -> None:
    used = [(module.split(".")[0], name) for module, name, _ in _own()]
    stale = [
        f"{room} -> {door}"
        for room, doors in DOORS.items()
        for door in doors
        if not any(user == room and (name == door or name.startswith(door + ".")) for user, name in used)
    ]
    assert stale == []


@cache
def _open(room: str, name: str) -> tuple[str, ...]:
    """Return a list that the ``__init__`` of a room declares; nothing where it declares none.

    Where it names in place of ``__all__`` the module of its register, by ``OPENED_BY``, what this imports is open.
    """
    folder = PACKAGE.joinpath(*room.split("."))
    tree = ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value is not None:
            declared, value = node.target.id, node.value
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            declared, value = node.targets[0].id, node.value
        else:
            continue
        if declared == name:
            return tuple(ast.literal_eval(value))
        if declared == "OPENED_BY" and name == "__all__":
            inside = f"eomgen.{room}."
            imported = (module for module, _ in _imports(folder / f"{ast.literal_eval(value)}.py"))
            return tuple(module.removeprefix(inside) for module in imported if module.startswith(inside))
    return ()


def _passed(module: str, target: str) -> Iterator[tuple[str, str, str]]:
    """Yield the doors that an import passes: the room, what is imported of it, and the list that has to name it."""
    parts, own = target.split("."), module.split(".")
    common = 0
    while common < min(len(parts), len(own)) and parts[common] == own[common]:
        common += 1
    for depth in range(common + 1, len(parts)):
        within = depth - 1 == common and common > 0  # both are in the room that holds this one
        yield ".".join(parts[:depth]), parts[depth], "WITHIN" if within else "__all__"


def test_modules_are_imported_through_the_doors_of_their_rooms() -> None:
    wrong = [
        f"{module} imports {target}: {name} is not in {which} of {room}"
        for module, target, _ in _own()
        for room, name, which in _passed(module, target)
        if name not in _open(room, "__all__") and not (which == "WITHIN" and name in _open(room, "WITHIN"))
    ]
    assert wrong == []


def test_rooms_name_only_what_others_import() -> None:
    passed = {door for module, target, _ in _own() for door in _passed(module, target)}
    outside = {(room, name) for room, name, which in passed if which == "__all__"}
    stale = []
    for room in sorted({module.rpartition(".")[0] for module, _ in _modules()} - {""}):
        modules = [name for name in _open(room, "__all__") if _is_module(f"eomgen.{room}.{name}")]
        stale += [f"{room}.{name}" for name in modules if (room, name) not in outside]
        stale += [f"{room}.{name}" for name in _open(room, "WITHIN") if (room, name, "WITHIN") not in passed]
    assert stale == []


@pytest.mark.parametrize("room", ORDER)
def test_parts_of_a_room_import_from_those_before_them(room: str) -> None:
    level = {part: number for number, line in enumerate(ORDER[room]) for part in line.split()}
    found = {module.removeprefix(room + ".").split(".")[0] for module, _ in _modules() if module.startswith(room + ".")}
    assert set(level) == found
    wrong = []
    for module, name, _ in _own():
        if module.startswith(room + ".") and name.startswith(room + "."):
            user, part = (text.removeprefix(room + ".").split(".")[0] for text in (module, name))
            if user != part and level[part] >= level[user]:
                wrong.append(f"{module} imports {name}")
    assert wrong == []


def test_files_import_one_another_in_no_circle() -> None:
    graph: dict[str, set[str]] = {}
    for module, name, _ in _own():
        if module != name:
            graph.setdefault(module, set()).add(name)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def _reason(module: str, target: str, table: Mapping[str, Mapping[str, str]]) -> tuple[str, str] | None:
    for user, targets in table.items():
        if module == user or module.startswith(user + ".") or (user == "eomgen" and not module):
            for name in targets:
                if not name or target == name or target.startswith(name + "."):
                    return user, name
    return None


def test_imports_within_functions_have_a_reason() -> None:
    late = [(module, target) for module, target, kind in _own() if kind is Kind.LATE]
    wrong = [
        f"{module} imports {target} within a function"
        for module, target in late
        if _reason(module, target, LATE) is None
    ]
    assert wrong == []
    used = {_reason(module, target, LATE) for module, target in late}
    assert {(user, name) for user, targets in LATE.items() for name in targets} - used == set()


def test_sympy_is_imported_where_laws_are_derived_only() -> None:
    wrong = [
        module
        for module, path in _modules()
        if module.split(".")[0] not in SYMPY_ROOMS
        for name, kind in _imports(path)
        if name.split(".")[0] == "sympy" and kind is not Kind.TYPING
    ]
    assert wrong == []


def test_dask_is_imported_where_it_is_asked_for_only() -> None:
    every = [(module, name, kind) for module, path in _modules() for name, kind in _imports(path)]
    assert {module for module, name, _ in every if name.split(".")[0] in ("dask", "distributed")} == {
        "ensembles.worker"
    }
    assert {kind for _, name, kind in every if name.startswith("eomgen.products.ensembles.worker")} == {Kind.LATE}


def test_nothing_is_evaluated_or_unpickled() -> None:
    wrong = []
    for module, path in _modules():
        wrong += [f"{module} imports {name}" for name, _ in _imports(path) if name.split(".")[0] in NO_PICKLE_NO_EVAL]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id in ("eval", "exec", "compile")
            ):
                wrong.append(f"{module}:{node.lineno} calls {node.func.id}")
            if isinstance(node, ast.Name | ast.Attribute):
                name = node.id if isinstance(node, ast.Name) else node.attr
                if name in ("sympify", "parse_expr"):
                    wrong.append(f"{module}:{node.lineno} uses {name}")
    assert wrong == []


#: Private names that Python offers.
_OFFERED = {"_replace", "_asdict", "_getframe"}


def test_private_names_are_used_in_their_own_modules() -> None:
    wrong = []
    for module, path in _modules():
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        own = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
        own |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        own |= {node.attr for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)}
        slots = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        for node in nodes:
            if isinstance(node, ast.Attribute) and _is_private(node.attr) and node.attr not in own | slots | _OFFERED:
                wrong.append(f"{module}:{node.lineno} uses {node.attr}")
            if isinstance(node, ast.ImportFrom):
                wrong += [f"{module} imports {alias.name}" for alias in node.names if _is_private(alias.name)]
    assert wrong == []


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def _run(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(PACKAGE.parent), **environment},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_package_imports_nothing_heavy() -> None:
    heavy = ("sympy", "numpy", "pydantic", "matplotlib", "cffi", "click", "jinja2", "scipy")
    assert _run(f"import sys, eomgen; print([name for name in {heavy!r} if name in sys.modules])").strip() == "[]"


def test_the_package_imports_without_a_compiler(tmp_path: Path) -> None:
    code = "import eomgen; s = eomgen.SceneBuilder('x'); print(eomgen.__version__, callable(eomgen.build))"
    assert _run(code, PATH=str(tmp_path), CC="nothing").strip() == f"{eomgen.__version__} True"


_CACHED = """
import sys
import eomgen
model = eomgen.build({path!r}, profile="quick")
run = model.simulate(1e-3, 1e-3)
print(run.success, [name for name in ("sympy", "jinja2", "scipy", "matplotlib", "setuptools") if name in sys.modules])
"""


@pytest.mark.slow
def test_a_cached_model_runs_without_sympy(tmp_path: Path) -> None:
    from tests.models.scenes import PENDULUM_TOML

    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    cache = {"EOMGEN_CACHE": str(tmp_path / "cache")}
    first = _run(_CACHED.format(path=str(path)), **cache)
    # an edit of the checkout in between builds anew
    later = [_run(_CACHED.format(path=str(path)), **cache) for _ in range(3)]
    second = next((text for text in later if text.startswith("True []")), later[-1])
    assert first.startswith("True ['jinja2'")
    assert second.startswith("True []")
