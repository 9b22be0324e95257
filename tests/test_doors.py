"""The rooms of the package open downwards only, and SymPy stays out of the way from a cached build to a running
model."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum, auto
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import eomgen
from tests.syntax import facts

PACKAGE = Path(eomgen.__file__).parent

#: Identifiers of products that the core must not use, by the product's package.
PRODUCT_WORDS: dict[str, set[str]] = {
    "products.studies": {
        *("compared", "contender", "facts_of", "fine_by", "identification", "ladder", "ladders", "method_facts"),
        *("policies", "policy", "studied", "tuning", "work_precision"),
    },
    "products.contacts": {"TangentialLaw", "TyreFile", "tangential_law"},
    "products.derivatives": {"run_sensitivities", "sensitivities"},
    "products.ensembles": {"Ensemble", "designs", "ensemble", "ensembles", "lane_code"},
    "products.reliability": {
        *("RandomProcess", "RandomVibration", "covariances", "importance_sampling", "karhunen_loeve"),
        *("most_probable_point", "processes", "random_processes", "random_vibration", "reliability", "vibration"),
    },
    "products.fields": {"FieldSystem", "Hamiltonian", "HamiltonianModel", "hamiltonian", "posterior", "posteriors"},
    "products.fmu": {"fmu", "fmu_files"},
    "products.laws": {"FileLaw"},
    "products.linear": {
        *("Campbell", "Floquet", "Linearization", "RootLocus", "StateSpace", "campbell", "eigenvalue_loci", "floquet"),
        *("linearize", "lqr", "multiblade", "psd", "random_response", "root_locus", "with_controller"),
    },
    "products.optimisers": {"CASADI", "casadi", "jax", "torch"},
    "products.maps": {"MapSurface", "surfaces"},
    "products.pictures": {"InlineAnimation", "Rainflow", "animate", "rainflow", "section_drawing"},
    "products.statics": {"BucklingLoads", "EquilibriumPath", "LoadPaths", "SteadyMotion", "path_following"},
    "products.robots": {"MJCF", "SDF", "URDF", "mjcf", "sdf"},
    "products.waves": {
        *("Hull", "Sea", "WaveField", "bound_waves", "crest", "hulls", "sea", "sea_states", "water", "wave_quantity"),
    },
}

#: For each room: the other rooms that it may import, or the one module of a room, between blanks. Every room is here; a
#: product is a room of its own.
TABLE_OF_DOORS: dict[str, str] = {
    # for every room
    "base": "errors",
    "errors": "base.data",
    # arrays and C alone
    "toolchain": "base errors",
    "solvers": "base errors lie",
    # from a description to C
    "symbolic": "base.data",
    "lie": "base.data symbolic",
    "formula": "base errors symbolic",
    "system": "base errors formula lie symbolic",
    "scene": "base errors formula lie system",
    "mechanics": "base errors formula lie scene symbolic system",
    "integrators": "base errors lie symbolic system",
    "codegen": "base errors integrators symbolic system",
    # a compiled model, and its results
    "compiled": "base errors formula lie solvers system toolchain",
    "results": "base compiled errors lie system",
    "simulation": (
        "base compiled errors formula integrators lie results solvers.regular_inertia solvers.sparse_rows system "
        "toolchain"
    ),
    # verbs
    "pipeline": (
        "base codegen compiled errors formula integrators lie mechanics scene simulation solvers symbolic system "
        "toolchain"
    ),
    "cli": "base compiled.rest errors formula mechanics pipeline results scene simulation system toolchain",
    "__main__": "cli",
    # products
    "products.derivatives": (
        "base compiled errors formula integrators lie simulation solvers.regular_inertia system toolchain"
    ),
    "products.ensembles": (
        "base cli codegen compiled errors formula integrators pipeline results simulation system toolchain"
    ),
    "products.reliability": (
        "base cli compiled errors formula pipeline results scene simulation solvers.quadrature system "
        "products.derivatives products.ensembles"
    ),
    "products.waves": (
        "base cli codegen errors formula integrators.compositions mechanics scene symbolic system toolchain"
    ),
    "products.contacts": (
        "base cli compiled errors formula integrators lie mechanics results scene simulation symbolic system"
    ),
    "products.fmu": "base cli codegen errors formula pipeline scene system toolchain",
    "products.fields": "base cli codegen errors formula integrators lie pipeline scene symbolic system toolchain",
    "products.studies": (
        "base cli compiled errors formula integrators lie pipeline results scene simulation solvers.quadrature "
        "solvers.regular_inertia symbolic system toolchain products.derivatives"
    ),
    "products.optimisers": (
        "base codegen compiled errors integrators lie pipeline symbolic system toolchain products.derivatives"
    ),
    "products.controllers": "base codegen errors symbolic",
    "products.laws": "base cli errors formula scene symbolic system toolchain",
    "products.gpu": "base codegen compiled errors pipeline system toolchain products.ensembles",
    "products.linear": (
        "base cli compiled errors formula lie pipeline results scene simulation solvers system products.statics"
    ),
    "products.maps": "base errors formula scene symbolic",
    "products.robots": "base errors formula lie scene system",
    "products.pictures": "base cli compiled errors formula lie pipeline results scene system",
    "products.doubts": "base cli compiled errors formula integrators lie results scene simulation system",
    "products.statics": "base cli compiled errors lie pipeline solvers system",
    "products.pages": (
        "base cli codegen compiled errors formula integrators pipeline results scene simulation symbolic system "
        "toolchain products.pictures products.studies"
    ),
    "products.comparison": "base cli errors formula lie pipeline scene symbolic system",
    "products.suspension": "base cli compiled errors formula pipeline scene products.pictures",
    "products.sympy_mechanics": "base errors formula lie pipeline symbolic system",
    "products.testing": (
        "base compiled errors integrators lie mechanics pipeline scene symbolic system products.pictures"
    ),
    "products.offered": "",
    "products.model_methods": (
        "compiled simulation products.derivatives products.ensembles products.linear products.pages products.statics"
    ),
    "products.solution_methods": "products.linear products.pictures",
    "products.exported": (
        "products.comparison products.fields products.fmu products.gpu products.linear products.optimisers "
        "products.reliability products.studies products.suspension products.sympy_mechanics products.testing "
        "products.waves"
    ),
}

#: Imports of products by the core that are left, by importing module: none may be added.
OF_PRODUCTS: dict[str, set[str]] = {
    "base.products": {"products.offered"},  # stays: messages name a product that is not installed
    "results.solution": {"products.solution_methods"},  # stays: a type checker reads methods of products
    "pipeline.model": {"products.model_methods"},  # likewise
}

#: For rooms with an inner order: their parts, each of which imports only from parts of lines before its own.
ORDER: dict[str, tuple[str, ...]] = {
    "scene": (
        "joint_types rotations",
        "inertia",
        "design_poses formula",
        "reading",
        "section",
        "signals",
        "bodies",
        "joints",
        "forces",
        "control events tree",
        "scene sections sources",
        "document",
        "repeat",
        "include",
        "load",
        "builder_examples",
        "builder_methods",
        "builder_keys",
        "builder",
    ),
    "mechanics": (
        "linear_parameters",
        "describe laws shape_functions",
        "discontinuities tree",
        "kinematics",
        "forces",
        "beam_axes constraints dynamics named_constants rates",
        "reactions",
        "scene_tape",
        "initial_coordinates terms",
        "controller derive",
        "savings",
    ),
    "codegen": (
        "program",
        "folder metadata scheduling",
        "series targets",
        "continuation convert",
    ),
    "symbolic": (
        "operations",
        "tape",
        "branches edges map scalar",
        "external",
        "latency",
        "calculus evaluate kernel periodic rotation series summation",
        "reading symbolic_kernel zeros",
    ),
    "integrators": (
        "compositions harmonics newton",
        "step_work",
        "families",
        "events stepper_layout",
        "stepper_data",
    ),
    "simulation": (
        "stepping",
        "accuracy",
        "judgement",
        "automatic_method motions option_types timing",
        "run_model",
        "outcome request",
        "checkpoint",
        "execution simulator",
        "bounded_steps resume start",
        "simulate",
    ),
    "products.derivatives": (
        "equations functionals linear_steps motion steps",
        "momenta start",
        "linear_run",
        "alpha_run crossings jump_motion jump_partials linear_operations",
        "jump_run partitioned_steps",
        "transition_run",
        "second_order",
        "stationary_run",
        "run_sensitivities",
        "linearise",
    ),
    "products.gpu": (
        "driver names nvrtc",
        "arrays requirements",
        "target",
        "ensembles kernels",
        "calls jax_kernels",
        "functions",
    ),
    "products.linear": (
        "eigenvalues freedom other_words spectra",
        "modes multiblade plots state_space",
        "campbell_plot sampling",
        "augmentation floquet random_response second_order_modes",
        "control linearization",
        "calibration controllers eigenvalue_loci",
        "campbell_search files",
        "analyses",
        "command",
    ),
    "products.studies.tuning": (
        "judge",
        "race result",
        "tune",
    ),
    "products.studies.ladders": (
        "runs scaling",
        "subject",
        "register",
        "result",
        "study",
    ),
    "products.studies.work_precision": (
        "axes observation",
        "formulations",
        "running",
        "reference result",
        "study",
    ),
    "products.studies.identification": (
        "estimation measurements",
        "result",
        "experiment",
        "judgement",
        "torques",
        "study",
    ),
    "products.fields.posteriors": (
        "mesh",
        "cells operators record",
        "posterior",
        "sampling",
    ),
    "products.fields.sampling": (
        "problem",
        "result",
        "run",
    ),
    "products.waves.second_order": (
        "kernels motion",
        "pairs",
        "limits profiles routines",
        "sea",
        "radar stepping",
    ),
    "products.studies.verification": (
        "claims",
        "differences states",
        "report",
        "check",
    ),
}

#: Imports within functions, by importing room or module: what is imported, and why it waits. No others are allowed.
LATE: dict[str, dict[str, str]] = {
    "products.reliability.section.covariances": {
        "products.ensembles": "few processes have a distribution, which SciPy's functions evaluate",
    },
    "__main__": {"cli": "Ctrl-C while it is imported leaves no traceback"},
    "scene.joints.moved_inertia": {"scene.joints.tree": "a scene of a record is not read"},
    "scene.tree.sections": {
        "scene.bodies.beam_reading": "most scenes have no beams",
        "scene.bodies.cosserat_reading": "likewise",
    },
    "compiled.initial_state": {"solvers.consistency": "most models have no constraints"},
    "solvers.consistency": {
        "solvers.strain_energy": "SciPy; few loops strain their beams",
        "solvers.rigid_beams": "few models have exact beams",
    },
    "solvers.constraint_rows": {"solvers.sparse_rows": "rows of large systems alone are sparse"},
    "compiled.beams": {"solvers": "few models have exact beams"},
    "compiled.functions": {"compiled.result_memory": "large batches alone use it"},
    "compiled.model": {"solvers": "most models have no constraints"},
    "toolchain.cffi_build": {"toolchain.rows_ahead": "few processes compile lanes"},
    "eomgen": {
        "base.calls": "for a mistake only",
        "base.data": "for public names; the package alone is imported in no time",
        "base.threads": "likewise",
        "base.products": "the core needs no product; most imports are of files",
    },
    "results.finding": {"base.message_codes": "read when a code is asked for"},
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
    "products.ensembles.cluster": {
        "products.ensembles.worker": "distributed, an optional package, for those who ask for a cluster"
    },
    "products.comparison.command": {"": "as in cli"},
    "products.comparison.compare": {"products.comparison.other_readers": "optional packages"},
    "products.ensembles.command": {"": "as in cli"},
    "products.suspension.command": {"": "as in cli"},
    "products.fields.commands": {"": "as in cli"},
    "products.fmu.command": {"": "as in cli"},
    "products.fields.file_kind": {
        "products.fields.commands": "Click and tables; for the command line",
        "products.fields.documents.entries": "for editors alone",
    },
    "products.linear.command": {"": "as in cli"},
    "products.laws.code": {
        "toolchain.builder": "scenes are read without a compiler",
        "toolchain.compiler": "as the builder",
        "toolchain.python_functions": "files in Python are executed at a build",
    },
    "products.pages.commands": {"": "as in cli"},
    "products.pictures.command": {"": "as in cli"},
    "products.statics.command": {"": "as in cli"},
    "products.reliability.command": {"": "as in cli"},
    "products.studies.model_commands": {"": "as in cli"},
    "products.studies.run_commands": {"": "as in cli"},
    "mechanics.derive": {
        "mechanics.rates.jets": "few models have time derivatives",
        "mechanics.terms": "terms of few models",
    },
    "mechanics.terms.recorders": {"mechanics.terms.further_recorders": "terms of few models"},
    "mechanics.tree.build": {"mechanics.shape_functions": "SciPy and mpmath; most scenes have no beams"},
    "mechanics.forces.distributed_loads": {"mechanics.shape_functions": "SciPy and mpmath; as above"},
    "codegen.convert": {
        "codegen.scheduling": "texts of a library that differs from an earlier one in numbers alone are not written",
        "codegen.series": "few methods step by series",
    },
    "codegen.targets.register": {"codegen.targets.c.target": "as scheduling in codegen.convert"},
    "codegen.targets.c.target": {"codegen.targets.c.templates": "Jinja; texts of the cache are not rendered"},
    "mechanics.forces.section_loads": {"mechanics.forces.distributed_loads": "schemas; few scenes have loads on beams"},
    "pipeline.scenes": {
        "mechanics": "SymPy; a cached model needs none of it",
        "pipeline": "SciPy; a cached model needs none of it",
        "scene": "the classes of scenes; a cached model needs none of them",
    },
    "products.fields.hamiltonian.model": {
        "codegen.metadata": "a cached model needs no Jinja",
        "products.fields.hamiltonian.code": "a cached model needs no Jinja",
    },
    "products.fields.front_end": {
        "codegen.folder": "a model is built without it",
        "products.fields.hamiltonian": "most scenes are mechanical",
        "products.fields.documents.reading": "most scenes are mechanical",
        "products.fields.documents.field_reading": "most scenes are mechanical",
        "toolchain.builder": "reading needs no compiler",
    },
    "pipeline.front_end": {
        "scene.scene": "the class of scenes; a cached model needs none",
        "scene.sources.register": "the sources; a scene of a record is not read",
    },
    "pipeline.documents": {
        "base.files": "a scene of a record is not read",
        "integrators.families": "the methods of scenes are looked up with the library",
        "scene": "a scene of a record needs no reader and no classes of scenes",
    },
    "pipeline.methods": {"integrators.families": "methods are looked up with the library; loading a scene needs none"},
    "pipeline.requests": {"toolchain": "a compiler is looked for when the arguments are known to be fine"},
    "pipeline.suppliers": {
        "integrators.families": "few models take another method",
        "system.branches": "most scenes have none",
    },
    "pipeline.programs": {"pipeline.generated_defaults": "SciPy; for C that stands alone"},
    "pipeline.generation": {"": "as in pipeline.pipeline"},
    "pipeline.readings": {"scene.sources.register": "the sources; a scene of a record is not read"},
    "pipeline.content": {"integrators.families": "methods are looked up with the library; loading a scene needs none"},
    "pipeline.libraries": {
        "codegen": "a library of the cache needs no Jinja",
        "pipeline.structures": "a library of the cache is not derived",
        "pipeline.model": "while a compiler runs",
        "simulation": "likewise",
    },
    "pipeline.pipeline": {
        "": "each stage is imported when it is reached: a cached model needs no SymPy, no Jinja and no SciPy",
    },
    "results.solution": {"results.plots": "pictures are drawn on request"},
    "scene.sources.register": {
        "scene.sources.renamed_keys": "a scene of a record is not read",
        "scene.reading.xml": "for endings that several formats share",
    },
    "scene.load": {
        "scene.document": "pydantic is slow to import, and the cached path of a made Scene needs none",
        "scene.include": "most scenes include nothing",
        "scene.repeat": "likewise",
    },
    "compiled.terms": {"system.system": "the class of systems; few calls give a motion of the base"},
    "simulation.execution": {"simulation.accuracy": "errors are estimated when the solution is asked for them"},
    "simulation.outcome": {"simulation.judgement": "a run is judged when its solution is asked for it"},
    "products.doubts.settings": {
        "compiled.rest": "few scenes and calls silence a doubt",
        "base.products": "likewise",
        "scene.document": "likewise",
        "simulation.judgement": "likewise",
    },
    "products.doubts.doubtful_elements": {"products.doubts.places": "most scenes have no tyres"},
    "products.contacts.step_check": {"products.contacts": "most runs have no contacts"},
    "products.doubts.remarks": {"products.doubts": "few runs have events, or states of few values"},
    "simulation.judgement.finished_run": {
        "compiled.rest.state_warnings": "a run is judged when its solution is asked for it",
        "simulation.accuracy": "likewise",
        "simulation.judgement": "likewise",
    },
    "simulation.stepping.settings": {
        "formula.motion_faults": "it evaluates on the tape; most scenes prescribe no motion",
    },
    "simulation.stepping.states": {"compiled.rest.equilibrium": "SciPy; most runs do not start from equilibrium"},
    "system.system": {"symbolic.reading": "SymPy; only for reading a term"},
    "toolchain.library": {
        "toolchain.python_functions": "few models call functions in Python",
    },
}
SYMPY_ROOMS = {"symbolic", "mechanics", "lie", "products.pages", "products.sympy_mechanics"}
NO_PICKLE_NO_EVAL = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}


def _is_present(room: str) -> bool:
    """Return whether a room is of the core, or of a product that was not removed."""
    path = PACKAGE.joinpath(*room.split(".")[:2])
    return (
        not room.startswith("products.")
        or path.is_dir()
        or path.with_suffix(".pyi").is_file()
        or path.with_suffix(".py").is_file()
    )


# a product is removed by its files alone (``tests.product_parts``): rows of absent products are left out
PRODUCT_WORDS = {room: words for room, words in PRODUCT_WORDS.items() if _is_present(room)}
DOORS = {room: {*filter(_is_present, doors.split())} for room, doors in TABLE_OF_DOORS.items() if _is_present(room)}
ORDER = {room: parts for room, parts in ORDER.items() if _is_present(room)}
LATE = {
    user: {name: reason for name, reason in reasons.items() if _is_present(name)}
    for user, reasons in LATE.items()
    if _is_present(user)
}


class Kind(Enum):
    """When an import happens: with its module, within a function, or for type checkers only."""

    TOP = auto()
    LATE = auto()
    TYPING = auto()


@cache
def _modules() -> tuple[tuple[str, Path], ...]:
    found = []
    stubs = set(PACKAGE.rglob("*.pyi")) - set(PACKAGE.glob("*.pyi"))  # the latter are public names of modules elsewhere
    for path in sorted([*PACKAGE.rglob("*.py"), *stubs]):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found.append((".".join(parts[:-1] if parts[-1] == "__init__" else parts), path))
    return tuple(found)


def imports_of(path: Path, tree: ast.Module) -> tuple[tuple[str, str, Kind], ...]:
    """Return every imported module, the name that it is asked for, if any, and when it is imported."""
    kinds: dict[ast.AST, Kind] = {}

    def walk(node: ast.AST, kind: Kind) -> None:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            kind = Kind.TYPING
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kind = Kind.LATE
        elif isinstance(node, ast.Import | ast.ImportFrom):
            kinds[node] = kind
        elif isinstance(node, ast.expr):
            return  # no statement, and no import, is within an expression
        for child in ast.iter_child_nodes(node):
            walk(child, kind)

    walk(tree, Kind.TOP)
    found = []
    for node, kind in kinds.items():
        if isinstance(node, ast.Import):
            found += [(alias.name, "", kind) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide which door is used"
            found += [(node.module or "", alias.name, kind) for alias in node.names]
    return tuple(dict.fromkeys(found))


@cache
def _is_module(name: str) -> bool:
    path = PACKAGE.parent.joinpath(*name.split("."))
    return any(path.with_suffix(ending).is_file() for ending in (".py", ".pyi")) or path.is_dir()


def _own() -> Iterator[tuple[str, str, Kind]]:
    """Yield importing module, imported module and kind of all imports within the package, names without ``eomgen.``."""
    for module, name, kind in _imports():
        if name.split(".")[0] == "eomgen":
            yield module, name.removeprefix("eomgen").removeprefix("."), kind


def _imports() -> Iterator[tuple[str, str, Kind]]:
    """Yield importing module, imported module and kind of all imports."""
    for module, path in _modules():
        for whole, part, kind in facts()[path].imports:
            name = f"{whole}.{part}"
            yield module, name if part and _is_module(name) else whole, Kind[kind]


def room_of(module: str) -> str:
    """Return the room of a module: its package on the first floor, or its product."""
    parts = module.split(".")
    return ".".join(parts[: 2 if parts[0] == "products" else 1])


def _may(module: str, target: str) -> bool:
    room = room_of(module)
    doors = {room, *DOORS[room], *OF_PRODUCTS.get(module, ())}
    return any(target == door or target.startswith(door + ".") for door in doors)


def test_every_room_is_in_the_table() -> None:
    assert {room_of(module) for module, _ in _modules()} - {"", "products"} == set(DOORS)


@pytest.mark.parametrize("room", DOORS)
def test_rooms_import_what_their_doors_allow(room: str) -> None:
    wrong = [
        f"{module} imports {name}"
        for module, name, _ in _own()
        if module and room_of(module) == room and not _may(module, name)
    ]
    assert wrong == []


def test_imports_of_products_by_the_core_are_in_use() -> None:
    used = {(module, name) for module, name, _ in _own()}
    assert {(module, name) for module, names in OF_PRODUCTS.items() for name in names} - used == set()


#: Attributes of nodes that hold a name.
_NAMED = {"id", "arg", "attr", "name", "asname", "module"}


def identifiers(nodes: Sequence[ast.AST]) -> frozenset[str]:
    """Return the names that code of a file uses or defines, and each part of the names that it imports."""
    values = (getattr(node, key, None) for node in nodes for key in _NAMED.intersection(node._fields))
    names = {value for value in values if isinstance(value, str)}
    return frozenset(part for name in names for part in name.split("."))


@pytest.mark.parametrize("product", PRODUCT_WORDS)
def test_core_rooms_do_not_use_words_of_a_product(product: str) -> None:
    used = {
        f"{module}: {name}"
        for module, path in _modules()
        if not module.startswith("products") and module not in OF_PRODUCTS
        for name in PRODUCT_WORDS[product].intersection(facts()[path].identifiers)
    }
    assert used == set()


@pytest.mark.parametrize("product", PRODUCT_WORDS)
def test_words_of_a_product_are_in_use_there(product: str) -> None:
    files = [path for module, path in _modules() if room_of(module) == product]
    assert PRODUCT_WORDS[product] <= {name for path in files for name in facts()[path].identifiers}


def test_no_door_is_open_for_nobody() -> None:
    used = [(room_of(module), name) for module, name, _ in _own()]
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

    If it names the modules that are not open in place of ``__all__``, by ``CLOSED``, all others of its folder are open.
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
        if declared == "CLOSED" and name == "__all__":
            closed = {"__init__", *ast.literal_eval(value)}
            return tuple(sorted(file.stem for file in folder.glob("*.py") if file.stem not in closed))
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
        for name in _open(room, "__all__"):
            is_module = _is_module(f"eomgen.{room}.{name}")
            if (room, name) not in outside if is_module else not hasattr(import_module(f"eomgen.{room}"), name):
                stale.append(f"{room}.{name}")
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
        for module, name, kind in _imports()
        if room_of(module) not in SYMPY_ROOMS and name.split(".")[0] == "sympy" and kind is not Kind.TYPING
    ]
    assert wrong == []


def test_dask_is_imported_where_it_is_asked_for_only() -> None:
    every = list(_imports())
    workers = {module for module, name, _ in every if name.split(".")[0] in ("dask", "distributed")}
    assert len(workers) <= 1
    assert {kind for _, name, kind in every if name.removeprefix("eomgen.") in workers} <= {Kind.LATE}


def evaluations(nodes: Sequence[ast.AST]) -> Iterator[str]:
    """Yield the lines of a file that execute a text, and the functions by which they do so."""
    for node in nodes:
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in ("eval", "exec", "compile")
        ):
            yield f"{node.lineno} calls {node.func.id}"
        if isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name in ("sympify", "parse_expr"):
                yield f"{node.lineno} uses {name}"


def test_nothing_is_evaluated_or_unpickled() -> None:
    wrong = []
    for module, path in _modules():
        imports = (name for name, _, _ in facts()[path].imports)
        wrong += [f"{module} imports {name}" for name in imports if name.split(".")[0] in NO_PICKLE_NO_EVAL]
        wrong += [f"{module}:{place}" for place in facts()[path].evaluations]
    assert wrong == []


#: Private names that Python offers.
_OFFERED = {"_replace", "_asdict", "_getframe", "_exit"}
#: Private names of SymPy's mechanics, which has no public names for neighbours of frames and points, for the Lagrangian
#: and for the parts of KanesMethod.
_OF_SYMPY = {
    *("_t", "_dict_list", "_dcm_dict", "_ang_vel_dict", "_vel_dict", "_pos_dict"),
    *("_L", "_f_h", "_f_nh", "_hol_coneqs", "_k_nh", "_inertial", "_uaux"),
    *("_acc_dict", "_k_kqdot_implicit", "_k_ku_implicit", "_f_k_implicit"),
}


def foreign(nodes: Sequence[ast.AST]) -> Iterator[str]:
    """Yield the lines of a file that use private names of other files, and the private names that it imports."""
    own = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    own |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    own |= {node.attr for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)}
    slots = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    known = own | slots | _OFFERED | _OF_SYMPY
    for node in nodes:
        if isinstance(node, ast.Attribute) and _is_private(node.attr) and node.attr not in known:
            yield f":{node.lineno} uses {node.attr}"
        if isinstance(node, ast.ImportFrom):
            yield from (f" imports {alias.name}" for alias in node.names if _is_private(alias.name))


def test_private_names_are_used_in_their_own_modules() -> None:
    assert [f"{module}{use}" for module, path in _modules() for use in facts()[path].foreign] == []


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
    assert _run(_CACHED.format(path=str(path)), **cache).startswith("True ['jinja2'")
    # an edit of the checkout in between builds anew
    assert any(_run(_CACHED.format(path=str(path)), **cache).startswith("True []") for _ in range(3))
