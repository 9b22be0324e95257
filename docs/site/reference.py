"""Generated pages of the reference: public names of Python, verbs of the command line, methods of integration."""

from __future__ import annotations

import contextlib
import inspect
import re
import shlex
import tomllib
from collections.abc import Container, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FunctionType
from typing import Any

from click.testing import CliRunner

from docs.site.docstrings import escaped
from docs.site.pages import Page, headings, read
from eomgen.base import message_codes
from eomgen.base.message_codes import MessageRow
from eomgen.base.products import OF_THE_CORE, products, public_modules
from eomgen.base.verbs import OWNERS, methods
from eomgen.cli import VERBS, commands
from eomgen.cli.explain import examples, explanation, topic_name
from eomgen.cli.explain import pages as pages_by_room
from eomgen.codegen.targets.c.uniform import MEANINGS
from eomgen.errors import UsageError
from eomgen.integrators.families.register import BUILT_IN, method_named
from eomgen.pipeline.generation import generate
from eomgen.scene.load import load_toml
from eomgen.system.system import BASE_LAYOUT, INPUT_BLOCKS
from tests.product_parts import facts_of

#: Classes of results that callers get from public functions, and do not make: name -> module.
RESULTS = {
    "Simulator": "eomgen.simulation.simulator",
    "StateArrays": "eomgen.compiled.coordinates",
    "PointMotion": "eomgen.compiled.bodies",
    "Assembly": "eomgen.solvers.consistency",
    "ActuatorEfforts": "eomgen.compiled.actuators",
    "InternalPartials": "eomgen.compiled.equations",
    "ParameterPartials": "eomgen.compiled.parameter_derivatives",
    "Regressor": "eomgen.compiled.parameter_derivatives",
    "BaseParameters": "eomgen.compiled.base_parameters",
    "Equilibrium": "eomgen.compiled.rest.equilibrium",
    "SectionLoads": "eomgen.compiled.beams",
    "ErrorEstimate": "eomgen.results.error_estimate",
    "LargestError": "eomgen.results.error_estimate",
    "SampleErrors": "eomgen.results.error_estimate",
    "Events": "eomgen.results.events",
    "Finding": "eomgen.results.finding",
    "StepEvent": "eomgen.simulation.simulator",
    "SimulatorState": "eomgen.simulation.checkpoint",
    "StrainedStart": "eomgen.solvers.beams",
    "WrittenStart": "eomgen.system.description",
    "Sparsity": "eomgen.compiled.argument_derivatives",
    "Counts": "eomgen.symbolic.operations",
}
for _product in products():
    RESULTS |= facts_of(_product).get("results", {})
#: Classes of the attributes of a Scene and of a System: name -> module. Their methods are for other rooms of the
#: package, and are not listed.
PARTS = {
    **dict.fromkeys(("Base", "Beam", "Body", "Deformation"), "eomgen.scene.bodies.model"),
    **dict.fromkeys(("BeamElement", "BeamSection", "Cosserat"), "eomgen.scene.bodies.cosserat"),
    "Curve": "eomgen.formula.curves",
    **dict.fromkeys(
        ("Constraint", "Frame", "Friction", "Joint", "Mimic", "Reaction", "Stop"), "eomgen.scene.joints.model"
    ),
    **dict.fromkeys(("Calibration", "Controller", "Reference", "StateFeedback"), "eomgen.scene.control.model"),
    **dict.fromkeys(("Spring", "TorsionSpring"), "eomgen.scene.forces.springs"),
    **dict.fromkeys(("Effort", "Force"), "eomgen.scene.forces.forces"),
    "Bushing": "eomgen.scene.forces.bushings",
    **dict.fromkeys(("Tendon", "Wrap"), "eomgen.scene.forces.tendons"),
    "Event": "eomgen.scene.events.model",
    "DesignPlace": "eomgen.scene.design_poses",
    "Motion": "eomgen.system.motions",
    **dict.fromkeys(("Assignment", "EventRow", "Mode"), "eomgen.system.events"),
    **dict.fromkeys(
        (
            "CSource",
            "Input",
            "NormalSeries",
            "Output",
            "Parameter",
            "PythonFunction",
            "RoadUnderWheel",
            "SampleRow",
            "SampledController",
            "Sampling",
            "State",
        ),
        "eomgen.system.signals",
    ),
    **dict.fromkeys(
        ("FixedFrame", "Point", "Requirement", "Rule", "Shape", "Simulation", "UnreadMesh"), "eomgen.system.description"
    ),
    **dict.fromkeys(
        (
            "BeamAxis",
            "BeamSlopes",
            "Discontinuity",
            "Facts",
            "Function",
            "Quantity",
            "Sample",
            "SecondBlocks",
            "Validity",
        ),
        "eomgen.system.system",
    ),
    "InputSymbol": "eomgen.symbolic.operations",
}
#: Folders of these classes, each with its title and a sentence.
GROUPS = {
    "results": ("Results", "Classes whose objects public functions return.", RESULTS),
    "parts": ("Parts of scenes and systems", "Classes of the attributes of a Scene and of a System.", PARTS),
}
#: Methods of public classes for other rooms of the package, which take objects that callers do not make.
INTERNAL = {
    "Configuration.simulation_keys",
    "ErrorEstimate.arrays",
    "ErrorEstimate.from_file",
    "ErrorEstimate.missing",
    "Events.arrays",
    "Events.columns",
    "Events.followed_by",
    "Events.to_dict",
    "Events.write",
    "Finding.from_data",
    "Finding.of",
    "Finding.rate",
    "Finding.to_dict",
    "Model.check_left_out",
    "Model.having",
    "Model.in_complex",
    "Model.jumps_between",
    "Model.library",
    "Model.stepper",
    "Model.stepper_in_lanes",
    "Simulator.begin",
    "SimulatorState.check",
    "Solution.later",
}
MODULES = {name: f"eomgen.{name}" for name in sorted(OF_THE_CORE | public_modules())}
FOLDER = "reference/python"


@cache
def public_objects() -> dict[str, tuple[str, Any]]:
    """Return the place of the reference page and the object of every public name, each object once.

    Names of ``eomgen`` come first, then names of its public modules, then classes of results.
    """
    found: dict[str, tuple[str, Any]] = {}
    seen: list[Any] = []
    homes = {"eomgen": "", **{module: f"{name}/" for name, module in MODULES.items()}}
    for module, folder in homes.items():
        owner = import_module(module)
        names = [name for name in getattr(owner, "__all__", ()) if not name.startswith("_")]
        objects = [(name, getattr(owner, name)) for name in names if hasattr(owner, name)]
        for name, value in objects:
            if inspect.ismodule(value) or any(value is other for other in seen):
                continue
            seen.append(value)
            same = [other for other, _ in objects if other.lower() == name.lower() and other != name]
            file = f"{name}_function" if same and inspect.isfunction(value) else name
            found[f"{module}.{name}"] = (f"{FOLDER}/{folder}{file}", value)
    for folder, (_, _, classes) in GROUPS.items():
        for name, module in classes.items():
            value = getattr(import_module(module), name)
            if not any(value is other for other in seen):
                seen.append(value)
                found[f"{module}.{name}"] = (f"{FOLDER}/{folder}/{name}", value)
    return found


def members(kind: type) -> Iterator[tuple[str, str, Any]]:
    """Yield name, directive of Sphinx and object of each documented public member of a class.

    Fields of dataclasses stand in the docstring of their class.
    """
    attached = methods(kind.__name__) if kind.__name__ in OWNERS else ()
    for name in () if PARTS.get(kind.__name__) == kind.__module__ else dir(kind):
        if name.startswith("_") or f"{kind.__name__}.{name}" in INTERNAL:
            continue
        home = next((base for base in kind.__mro__ if name in vars(base)), kind)
        if not home.__module__.startswith("eomgen"):
            continue
        value = getattr(kind, name) if name in attached else inspect.getattr_static(kind, name)
        if isinstance(value, property) or type(value).__name__ == "cached_property":
            if inspect.getdoc(value):
                yield name, "autoproperty", value
        elif isinstance(value, FunctionType | classmethod | staticmethod) and inspect.getdoc(getattr(kind, name)):
            yield name, "automethod", getattr(kind, name)


def summary(value: object) -> str:
    """Return the first paragraph of a docstring on one line, in reStructuredText."""
    text = (inspect.getdoc(value) or "").split("\n\n")[0]
    return escaped(" ".join(text.split()))


def _titled(title: str, mark: str = "=") -> str:
    return f"{title}\n{mark * len(title)}\n\n"


def _table(rows: list[tuple[str, str]]) -> str:
    lines = [".. list-table::", "   :widths: 30 70", "   :class: names", ""]
    for first, second in rows:
        lines += [f"   * - {first}", f"     - {second}"]
    return "\n".join(lines) + "\n\n"


def _kind_page(name: str, kind: type) -> str:
    text = _titled(kind.__name__) + f".. autoclass:: {name}\n\n"
    listed = list(members(kind))
    groups = (("Methods", "automethod", "meth"), ("Properties", "autoproperty", "attr"))
    for title, directive, role in groups:
        group = [(member, value) for member, its, value in listed if its == directive]
        if not group:
            continue
        text += _titled(title, "-")
        text += _table([(f":{role}:`{member} <{name}.{member}>`", summary(value)) for member, value in group])
        text += "".join(f".. {directive}:: {name}.{member}\n\n" for member, _ in group)
    return text


def python_pages() -> Iterator[Page]:
    """Yield one page for each public class, function and constant, and the lists of them."""
    lists: dict[str, list[tuple[str, str, str]]] = {}
    for name, (place, value) in public_objects().items():
        short = name.rpartition(".")[2]
        if inspect.isclass(value):
            text, row = _kind_page(name, value), summary(value)
        elif inspect.isfunction(value):
            text, row = _titled(short) + f".. autofunction:: {name}\n", summary(value)
        else:
            text, row = _titled(short) + f".. py:data:: {name}\n\n   {_value(value)}\n", _value(value)
        yield Page(place, text, ending=".rst")
        lists.setdefault(place.removeprefix(f"{FOLDER}/").rpartition("/")[0], []).append((short, place, row))
    for folder, rows in lists.items():
        if folder:
            yield Page(f"{FOLDER}/{folder}/index", _list_page(folder, rows), ending=".rst")
    text = _titled("Python") + "Names of ``eomgen``, each on a page of its own; then its modules.\n\n"
    text += _listed(lists[""]) + _titled("Modules", "-")
    text += _table([(f":doc:`{_module_title(name)} </{FOLDER}/{name}/index>`", _about(name)) for name in lists if name])
    text += _tree([*(place for _, place, _ in lists[""]), *(f"{FOLDER}/{name}/index" for name in lists if name)])
    yield Page(f"{FOLDER}/index", text, ending=".rst")


def _module_title(folder: str) -> str:
    return f"eomgen.{folder}" if folder in MODULES else GROUPS[folder][0]


def _about(folder: str) -> str:
    if folder in MODULES:
        return summary(import_module(MODULES[folder]))
    return GROUPS[folder][1]


def _list_page(folder: str, rows: list[tuple[str, str, str]]) -> str:
    return (
        _titled(_module_title(folder))
        + f"{_about(folder)}\n\n"
        + _listed(rows)
        + _tree([place for _, place, _ in rows])
    )


def _listed(rows: list[tuple[str, str, str]]) -> str:
    return _table([(f":doc:`{name} </{place}>`", text) for name, place, text in rows])


def _tree(places: list[str]) -> str:
    return ".. toctree::\n   :hidden:\n\n" + "".join(f"   /{place}\n" for place in places)


def _value(value: object) -> str:
    shown = re.sub(r"\s+", " ", repr(value))
    return f"Of type ``{type(value).__name__}``" + (
        f": ``{shown}``." if len(shown) < 300 and " at 0x" not in shown else "."
    )


#: Commands whose output the pages of their verbs show, in the order in which they run, in one folder.
SESSIONS = (
    "new arm",
    "doctor",
    "examples quarter_car",
    "info arm/scene.toml",
    "migrate --check arm/scene.toml",
    "equilibrium quarter_car/scene.toml",
    "linearize quarter_car/scene.toml",
    "simulate arm/scene.toml --t-end 2 --out arm/out",
    "plot arm/out",
    "animate arm/out/solution.npz --out arm/motion.html",
    "report arm/out --out arm/report.html",
    "generate arm/scene.toml --method rk4 --out arm_c",
    "fmu arm/scene.toml -o arm.fmu",
    "check arm/scene.toml --states 4",
    "savings arm/scene.toml",
    "tune arm/scene.toml --t-end 1 --output tip --error 1e-4 --out tuned.toml",
    "tradeoff arm/scene.toml --t-end 1 --output tip --methods rk4,generalized_alpha --budget 5 --out arm/tradeoff",
    "extremes arm/scene.toml --ladders step --out arm/extremes",
    "identify arm/scene.toml --data arm/out/solution.csv --parameters lower_mass",
    "examples density_field",
    "sample small_field.toml --out samples",
    "examples duffing_random_excitation",
    "random duffing_random_excitation/system/oscillator.toml --output deflection --out arm/random",
    "compare arm/scene.toml heavy.toml",
    'ensemble arm/scene.toml --t-end 1 --samples 8 --vary "lower_mass=normal(0.6 kg, 10 %)" --out arm/samples',
    "schema",
    "explain E0008",
    "cite generalized_alpha",
    "completion bash",
)
#: By verb: a scene, the name of a copy for the verb, and the text that the copy has in place of another.
COPIES = {
    "compare": ("arm/scene.toml", "heavy.toml", "value = 0.6", "value = 0.9"),
    "sample": ("density_field/system/density_field.toml", "small_field.toml", "[64, 64, 64]", "[8, 8, 8]"),
}
#: Lines of output on a page at most, and their columns, which a page of 1280 px shows.
_SHOWN, _COLUMNS = 40, 90


def sessions(wanted: Container[str] | None = None) -> dict[str, str]:
    """Return commands with the output that they print now, by verb.

    Parameters
    ----------
    wanted : container of str, optional
        Verbs; all by default.
    """
    shown: dict[str, str] = {}
    runner = CliRunner(env={"COLUMNS": str(_COLUMNS)})
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        for line in SESSIONS:
            verb, *words = shlex.split(line)
            if wanted is not None and verb not in wanted:
                continue
            if verb in COPIES:
                source, copy, old, new = COPIES[verb]
                Path(copy).write_text(Path(source).read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
            result = runner.invoke(commands, [verb, *words], prog_name="eomgen", standalone_mode=False)
            printed = re.sub(r"\x1b\[[0-9;]*m", "", result.output)
            if result.exception is not None or (result.return_value or 0) not in (0, 4 if verb == "compare" else 0):
                raise RuntimeError(f"eomgen {line} fails: {printed}") from result.exception
            lines = [row.rstrip() for row in printed.rstrip().splitlines()]
            lines = [*lines[:_SHOWN], "..."] if len(lines) > _SHOWN else lines
            shown.setdefault(verb, "\n".join((f"$ eomgen {line}", *lines)))
    return shown


def command_pages(examples: Mapping[str, str]) -> Iterator[Page]:
    """Yield one page for each verb, with the text that ``eomgen <verb> --help`` prints, and an example by verb."""
    runner = CliRunner()

    def printed(*words: str) -> str:
        return runner.invoke(commands, [*words, "--help"], prog_name="eomgen", terminal_width=_COLUMNS).output

    folder = "reference/command_line"
    rows = [f"| [{name}]({name}.md) | {verb.summary} |" for name, verb in VERBS.items()]
    names = "\n".join(("guide/contents", *VERBS))
    text = "\n".join(["# Command line", "", "| verb | does |", "|---|---|", *rows, ""])
    text += "\nOptions, files and exit codes are described in the [guide](guide/contents.md).\n"
    text += f"\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"
    yield Page(f"{folder}/index", text)
    for name, verb in VERBS.items():
        python = [target.partition(":")[2] for target in verb.methods]
        same = ", ".join(f"{{py:meth}}`Model.{it} <eomgen.Model.{it}>`" for it in python)
        text = f"# eomgen {name}\n\n{verb.summary}\n\n```text\n$ eomgen {name} --help\n{printed(name)}```\n"
        text += f"\n## Example\n\n```text\n{examples[name]}\n```\n" if name in examples else ""
        yield Page(f"{folder}/{name}", text + (f"\nFrom Python: {same}.\n" if same else ""))


def method_pages() -> Iterator[Page]:
    """Yield the table of all methods with orders and requirements, and one page for each family."""
    folder = "reference/methods"
    table = ["| method, other names | order | constraints | steps | parameters |", "|---|---:|---|---|---|"]
    pages: dict[str, list[str]] = {}
    for family in BUILT_IN:
        for row in family.names():
            try:
                method = method_named(row.name, **row.compiled_with)
            except UsageError as error:  # a case without damping, which is refused with the default parameters
                table.append(f"| `{row.name}` | | | | refused: {error.problems[0].what.split(',')[0]} |")
                continue
            parameters = ", ".join(f"`{name}`" for name in row.parameters)
            aliases = ", ".join(f"`{name}`" for name in row.aliases)
            holds = "yes" if method.holds_constraints else "no"
            steps = ("implicit" if method.implicit else "explicit") + (", by tolerance" if method.chooses_steps else "")
            link = f"[`{row.name}`]({family.family}.md#{row.name})"
            table.append(
                f"| {', '.join(filter(None, (link, aliases)))} | {method.order} | {holds} | {steps} | {parameters} |"
            )
            text = [f"## {row.name}\n", f"{method.title(method.holds_constraints)}.\n"]
            facts = [
                f"order {method.order}",
                steps,
                f"holds constraints: {holds}",
                f"states between rows: {method.dense_output}",
            ]
            text += [f"- {fact}" for fact in facts]
            text += [f"- parameters: {parameters}"] * bool(parameters)
            text += [
                f"- needs a system {'with' if need.value else 'without'} {need.fact.replace('_', ' ')}: {need.reason};"
                f" alternatives: {need.alternative}"
                for need in method.needs
            ]
            text += ["", f"Source: {method.source}"] if method.source else []
            pages.setdefault(family.family, []).append("\n".join(text) + "\n")
    names = "\n".join(pages)
    yield Page(
        f"{folder}/index",
        "# Methods of integration\n\nOrders are the declared ones; see [measured orders](../../evidence/orders.md).\n\n"
        + "\n".join(table)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{names}\n```\n",
    )
    for name, sections in pages.items():
        yield Page(f"{folder}/{name}", f"# {name.replace('_', ' ').capitalize()}\n\n" + "\n".join(sections))


def c_pages() -> Iterator[Page]:
    """Yield the page of the C interface: arguments in their order, and the header of the example of scene files."""
    (scene,) = re.findall(r"^```toml\n(.*?)^```$", read("docs/scene/an_example.md"), re.DOTALL | re.MULTILINE)
    name = tomllib.loads(scene)["name"]
    with TemporaryDirectory() as folder:
        generate(load_toml(scene), folder, method="rk4")
        header = (Path(folder) / f"{name}.h").read_text(encoding="utf-8")
    declared = header.partition('extern "C" {\n#endif\n')[2].rpartition("#if defined(__cplusplus)")[0]
    model, mark, stepper = declared.partition("/* ---- time integration")
    parts = {"Sizes": "#define", "Data": "typedef struct", "Functions of the equations": ""}
    shown: dict[str, list[str]] = {title: [] for title in parts}
    for block in filter(None, map(str.strip, model.split("\n\n"))):
        shown[next(title for title, word in parts.items() if word in block)].append(block)
    shown["Time integration"] = [(mark + stepper).strip()]
    text = (
        "# C interface\n\nEach folder of `eomgen generate` has a header with all functions of its scene; their names"
        " begin with the name of the scene. All functions are reentrant: they read and write their arguments alone,"
        " allocate no memory and know no globals. A function has the arguments that it reads, in this order, and then"
        " its results. Uses are described in [C code](../guide/c_code.md).\n\n| argument | meaning |\n|---|---|\n"
    )
    text += "".join(f"| `{block}` | {MEANINGS[block]} |\n" for block in INPUT_BLOCKS)
    text += "\nThe state `base` of the base:\n\n| member | numbers | meaning |\n|---|---:|---|\n"
    text += "".join(f"| `{member}` | {size} | {meaning} |\n" for member, size, meaning in BASE_LAYOUT)
    text += f"\nThe header of [the example of scene files](scene/an_example.md), `{name}`, with the method `rk4`:\n"
    for title, listed in shown.items():
        joined = "\n\n".join(listed)
        text += f"\n## {title}\n\n```c\n{joined}\n```\n"
    yield Page("reference/c_interface", text)


def message_pages() -> Iterator[Page]:
    """Yield a list of the parts that make messages, and for each part a page with its messages by code and examples."""
    folder, pages = "reference/messages", dict[str, list[MessageRow]]()
    for row in message_codes.rows():
        if row.kinds != "r":
            pages.setdefault(topic_name(row.room), []).append(row)
    for name, listed in sorted(pages.items()):
        page = pages_by_room()[name]
        title = headings(read(f"docs/{page}"))[0]
        text = f"# Messages: {name}\n\nMessages of `{name}` by code. See [{title}]({page}).\n\n"
        text += "| code | kind | message | remedy |\n|---|---|---|---|\n"
        for row in listed:
            parts = explanation(row)
            code = f'<a id="{row.code}"></a>`{row.code}`'
            cells = (code, parts["kind"], _cell(parts["message"]), _cell(parts["remedy"]))
            text += f"| {' | '.join(cells)} |\n"
        for code in dict.fromkeys(row.code for row in listed if row.code in examples()):
            title, example = examples()[code]
            text += f"\n**{code}: {title}**\n\n```text\n{example}\n```\n"
        place = name.replace(".", "_")
        yield Page(f"{folder}/{place}", text, source=f"docs/messages_{place}.md")  # links as from the folder docs
    count = len(message_codes.rows())
    introduction = (
        f"# Messages by code\n\nEach of {count} errors, notes and findings has a code. The command line prints the code"
        " at the end of a message, and Python has it as `error.code`. A code never changes. `eomgen explain E0008`"
        " prints the same text, and `eomgen explain mass negative` searches.\n\n"
    )
    table = "| part of eomgen | messages |\n|---|---:|\n"
    for name, listed in sorted(pages.items()):
        table += f"| [{name}]({name.replace('.', '_')}.md) | {len(listed)} |\n"
    tree = "\n".join(name.replace(".", "_") for name in sorted(pages))
    yield Page(f"{folder}/index", f"{introduction}{table}\n```{{toctree}}\n:hidden:\n\n{tree}\n```\n")


def _cell(text: str) -> str:
    """Return a text as code in a cell of a table; empty for none."""
    line = " ".join(text.split()).replace("`", "'").replace("|", "\\|")
    return f"`{line}`" if line else ""


def reference_pages(examples: Mapping[str, str] | None = None) -> Iterator[Page]:
    """Yield all generated pages; ``examples`` of commands with their output, by verb, as of ``sessions``."""
    yield from python_pages()
    yield from command_pages(examples or {})
    yield from method_pages()
    yield from c_pages()
    yield from message_pages()
