"""A stepper's C for one trajectory made into C for one trajectory in each lane, and the files of its library.

The author of a stepper writes the control flow of one trajectory: if, loops, return. In lanes each condition holds for
some trajectories only, so every block has a mask of the active lanes; code outside of such blocks is unchanged. Values
have the same bits as the scalar text, because each lane has the same operations in the same order (Karrenberg and Hack
2011, whole-function vectorisation; Pharr and Mark 2012, ispc).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from operator import itemgetter
from typing import Any

from pycparser import CParser

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c.templates import environment
from eomgen.compiled.model import CompiledModel
from eomgen.integrators.events import MOST, STOPPED
from eomgen.products.ensembles.lane_code.routine import RoutineText
from eomgen.products.ensembles.lane_code.source import (
    LaneSource,
    NoValue,
    Pointer,
    Type,
    UntranslatableConstruct,
    declaration,
    read,
)
from eomgen.toolchain.builder import REFUSED, Preprocess
from eomgen.toolchain.library import LaneLibrary, Library


def to_lanes(text: str, roots: Mapping[str, Collection[str]], outputs: Mapping[str, list[int]]) -> str:
    """Return the functions of a stepper for lanes, with all called functions.

    Parameters
    ----------
    text : str
        C without directives of the preprocessor: declarations of the model, and the stepper.
    roots : mapping from name to names
        Functions called from outside, and their pointer arguments that are always null. These functions have a mask as
        first argument; their whole numbers are the same for all lanes.
    outputs : mapping from name to sizes
        Functions of the model, which are compiled for lanes from a separate text; sizes of the output arrays, in the
        order of the parameters that are not constant.

    Raises
    ------
    UntranslatableConstruct
        The text has a construct that lanes cannot follow.
    """
    source = read(CParser().parse(text, "stepper"), outputs)
    missing = [name for name in roots if name not in source.routines]
    if missing:
        raise UntranslatableConstruct(f"no function {', '.join(missing)}")
    for name, null in roots.items():
        routine = source.routines[name]
        pointers = {each for each, kind in routine.parameters if isinstance(kind, Pointer)}
        routine.outside |= pointers
        routine.given |= pointers - set(null)
    for _ in range(20):
        before = _knowledge(source)
        made = _called_routines(source, roots, outputs)
        if _knowledge(source) == before:
            return _file(source, made, outputs)
    raise UntranslatableConstruct("the variables that differ from lane to lane were not determined")


def _called_routines(
    source: LaneSource, roots: Collection[str], outputs: Mapping[str, list[int]]
) -> dict[str, RoutineText]:
    waiting, made = list(reversed(list(roots))), dict[str, RoutineText]()
    while waiting:
        name = waiting.pop()
        if name in made:
            continue
        made[name] = RoutineText(source, source.routines[name], outputs)
        waiting += reversed([each for each in made[name].called if each not in made])
    return made


def _knowledge(source: LaneSource) -> list[tuple[str, frozenset[str], frozenset[str], list[tuple[str, Type]]]]:
    return [
        (
            name,
            frozenset(routine.varying | routine.given | routine.widened | ({"return"} if routine.gives else set())),
            frozenset(routine.outside),
            sorted(routine.elements.items(), key=itemgetter(0)),
        )
        for name, routine in source.routines.items()
    ]


def _file(source: LaneSource, made: Mapping[str, RoutineText], outputs: Mapping[str, list[int]]) -> str:
    functions = sorted({name for routine in made.values() for name in routine.functions})
    order = [name for name in source.routines if name in made]
    parts, templates = [*source.texts], environment()
    masked, each = (templates.get_template(f"ensembles/{name}.c.jinja") for name in ("masked", "each"))
    for name in functions:  # of the model, which write outputs of active lanes only
        kinds = source.functions[name]
        parts.append(f"void {name}({', '.join(declaration('', kind) for kind in kinds)});")
        sizes = enumerate(outputs[name], len(kinds) - len(outputs[name]))
        written = {i: size for i, size in sizes if isinstance(kinds[i], Pointer)}
        taken = [declaration(f"x{k}", kind) for k, kind in enumerate(kinds)]
        parts.append(masked.render(name=name, outputs=written, taken=taken).rstrip())
    for name in sorted({name for routine in made.values() for name in routine.foreign}):  # called for each lane
        arrays = [k for k, kind in enumerate(source.foreign[name]) if isinstance(kind, Pointer)]
        parts.append(each.render(name=name, count=len(source.foreign[name]), arrays=arrays).rstrip())
    parts += [made[name].signature + ";" for name in order]
    parts += [_both(source, made[name], outputs) for name in order]
    return "\n\n".join(parts) + "\n"


def _both(source: LaneSource, text: RoutineText, outputs: Mapping[str, list[int]]) -> str:
    """Return the C text of a translated function. A long one without branches and calls, whose result is void, has a
    second text for all lanes active, which the first one calls then."""
    short = text.stores < 6  # a second text is not worth its size
    if text.parts or text.called or text.functions or short or not isinstance(text.returns, NoValue):
        return text.text
    name = text.routine.name
    plain = RoutineText(source, text.routine, outputs, whole=True).text.replace(f" {name}(", f" {name}_whole(", 1)
    names = ", ".join(["live", *(parameter for parameter, _ in text.routine.parameters)])
    start = text.text.index("{\n") + 2
    choice = f"    if (eg_all(live)) {{\n        {name}_whole({names});\n        return;\n    }}\n"
    return f"{plain}\n\n{text.text[:start]}{choice}{text.text[start:]}"


_NUMBERS = """\
#define EOMGEN_IN_LANES
typedef double eomgen_real;
#ifdef EOMGEN_SHORT_NAMES
typedef double real;
#endif
"""
_OF_THE_LANGUAGE = ("math.h", "stddef.h", "stdint.h", "string.h")
_NULL = {"initialize": (), "loop": ("u_end", "record", "recorded")}


def stepper_in_lanes(model: CompiledModel, library: Library) -> LaneLibrary | str:
    """Return the library that steps several trajectories side by side with the stepper of `library`; or in words, the
    reason for which there is none."""

    def files_of(files: Mapping[str, str], preprocessed: Preprocess) -> Mapping[str, str]:
        try:
            return lane_files(files, library.layout, preprocessed)
        except UntranslatableConstruct as refusal:
            return {REFUSED: str(refusal)}

    interface = (template_folder() / "ensembles" / "lanes_interface.h").read_text(encoding="utf-8")
    return model.stepper_in_lanes(library, interface, files_of)


def lane_files(
    files: Mapping[str, str], layout: Mapping[str, Any], preprocessed: Callable[[Mapping[str, str], str], str]
) -> dict[str, str]:
    """Return C files and headers of the library of lanes.

    Parameters
    ----------
    files : mapping from name to text
        Files of the library of one trajectory.
    layout : mapping
        Of that library, with a method.
    preprocessed : callable
        From files and a name to the text of that file without directives of the preprocessor.

    Raises
    ------
    UntranslatableConstruct
        The stepper has something that lanes cannot follow.
    """
    prefix, method, sizes = str(layout["prefix"]), layout["method"], layout["sizes"]
    step = f"{prefix}_step.c"
    headers = {name: text for name, text in files.items() if name.endswith(".h")}
    plain = {**headers, **dict.fromkeys(_OF_THE_LANGUAGE, ""), "eomgen_real.h": _NUMBERS, step: files[step]}
    hooks = {name: method["hooks"].get(name) for name in ("recorded", "end")}
    null: dict[str, tuple[str, ...]] = {**_NULL, "write_row": ()}
    events = method.get("events", {"modes": ()})
    if not sizes["u"]:
        null = {"initialize": ("u_table",), "loop": (*_NULL["loop"], "u_table", "u"), "write_row": ("inputs",)}
    called = (*null, *filter(None, hooks.values()), *(["take_modes"] if events["modes"] else []))
    roots = {f"{prefix}_{name}": null.get(name, ()) for name in called}
    outputs = {
        f"{prefix}_{function['name']}": [int(output["size"]) for output in function["outputs"]]
        for function in layout["functions"]
    }
    body = to_lanes(preprocessed(plain, step), roots, outputs)
    templates = environment()
    driver = templates.get_template("ensembles/driver.c.jinja").render(
        P=prefix,
        parameters=sizes["p"],
        inputs=sizes["u"],
        input_rows=method["rows_per_step"] + 1,
        settings=method["settings"],
        q=sizes["q"],
        v=sizes["v"],
        z=sizes["z"],
        row=sum(size for _, size in method["row"]),
        state=method["state"],
        flat_size=sum(max(int(item["size"]), 1) for item in method["state"]),
        events={"most": MOST, "stop": STOPPED.number} if "events" in method else None,
        modes=[mode["parameter"] for mode in events["modes"]],
        **hooks,
    )
    text = templates.get_template("ensembles/stepper.c.jinja").render(prefix=prefix, body=body, driver=driver)
    kept = {name: text for name, text in files.items() if name not in ("interface.c", "interface.h", step)}
    return {
        **kept,
        "eomgen_lanes.h": templates.get_template("ensembles/lanes.h.jinja").render(),
        f"{prefix}_lanes.c": text,
    }
