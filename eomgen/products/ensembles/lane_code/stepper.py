"""The files of a library that steps several trajectories side by side, made from the files of the library of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from eomgen.codegen.targets.c.target import environment
from eomgen.compiled.model import CompiledModel
from eomgen.integrators.events import MOST, STOPPED
from eomgen.products.ensembles.lane_code.translate import NotInLanes, translated
from eomgen.toolchain.builder import REFUSED, Preprocess
from eomgen.toolchain.lane_library import LaneLibrary
from eomgen.toolchain.library import Library

#: The interface of a library of lanes; ``templates/c/lanes/driver.c.jinja`` implements it.
LANES_CDEF = """\
long eomgen_lanes_size(int what);
void eomgen_lanes_start(const double *parameters, const double *settings, const double *inputs, const double *start,
    double *state, double *workspace, int *statuses);
void eomgen_lanes_run(const double *parameters, const double *settings, const double *inputs, double *state,
    double *workspace, long steps, long rows, double *record, int *statuses);
void eomgen_lanes_groups(const double *parameters, const double *settings, const double *inputs,
    const double *table, const double *starts, double *state, double *workspace, long groups, long steps, long rows,
    long rest, double shorter, double *record, double *modes, double *flat, int *statuses);
void eomgen_lanes_state(const double *state, double *flat);
"""
_NUMBERS = """\
typedef double eomgen_real;
#ifdef EOMGEN_SHORT_NAMES
typedef double real;
#endif
"""
_OF_THE_LANGUAGE = ("math.h", "stddef.h", "stdint.h", "string.h")
_NULL = {"initialize": (), "loop": ("u_end", "record", "recorded")}


def stepper_in_lanes(model: CompiledModel, library: Library) -> LaneLibrary | str:
    """Return the stepper of a library of a model for several trajectories side by side, or why there is none."""

    def files_of(files: Mapping[str, str], preprocessed: Preprocess) -> Mapping[str, str]:
        try:
            return lane_files(files, library.layout, preprocessed)
        except NotInLanes as refusal:
            return {REFUSED: str(refusal)}

    return model.stepper_in_lanes(library, LANES_CDEF, files_of)


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
    NotInLanes
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
    body = translated(preprocessed(plain, step), roots, outputs)
    templates = environment()
    driver = templates.get_template("c/lanes/driver.c.jinja").render(
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
    text = templates.get_template("c/lanes/stepper.c.jinja").render(prefix=prefix, body=body, driver=driver)
    kept = {
        name: text
        for name, text in files.items()
        if name.endswith((".c", ".h")) and name not in ("main.c", "interface.c", "interface.h", step)
    }
    return {
        **kept,
        "eomgen_lanes.h": templates.get_template("c/lanes/lanes.h.jinja").render(),
        f"{prefix}_lanes.c": text,
    }
