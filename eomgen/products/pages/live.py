"""Live pages: one HTML file with the compiled model as WebAssembly, sliders, plots and the picture of a run."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from eomgen.base.calls import checked_call
from eomgen.base.files import check_writable, write_text
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.functions import compiled_or_same
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.register import terms_of
from eomgen.products.pages.sliders import sliders_of
from eomgen.products.pages.web_module import FUNCTIONS, WebModule, check_supported, web_module
from eomgen.products.pictures.animation import SCRIPTS, InlineAnimation, check_name, packed, page_of
from eomgen.products.pictures.beam_curves import pieces_of
from eomgen.results.finding import WARNING
from eomgen.simulation.simulate import simulate
from eomgen.simulation.stepping.inputs import jumps_known
from eomgen.system.terms import Selection

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.results.solution import Solution
    from eomgen.toolchain.library import Library

#: Curves of one plot.
CURVES = 6
_OF_LIVE = {
    "curves": "pages/curves.js",
    "growing_chart": "pages/growing_chart.js",
    "motion": "pages/motion.js",
    "live": "pages/live.js",
    "live_style": "pages/live.css",
}


@overload
def live(model: CompiledModel, path: str | Path, *, solution: Solution | None = None) -> Path: ...
@overload
def live(model: CompiledModel, path: None = None, *, solution: Solution | None = None) -> InlineAnimation: ...
@checked_call('model.live("page.html")')
def live(
    model: CompiledModel, path: str | Path | None = None, *, solution: Solution | None = None
) -> Path | InlineAnimation:
    """Write a page in which the model runs: one HTML file that needs no server.

    The page has the C of the model as WebAssembly, sliders for tunable parameters, inputs and initial values, plots of
    outputs and energies, and the picture. Steps have the digits of a model built with
    ``profile="reproducible"``.

    Parameters
    ----------
    path : path, optional
        File to write, ``.html``; without one the page is returned for a notebook.
    solution : Solution, optional
        Run of this model whose start, method, step, parameters and constant inputs the page takes, and whose estimated
        error the page states; a run with the scene's values by default.

    Returns
    -------
    Path
        The written file; without ``path`` the page for a notebook.

    Raises
    ------
    ModelError
        Laws or controllers in Python.
    UsageError
        Inputs of the run that are functions of Python or tables; a run of another process.
    ToolchainError
        The package ziglang is not installed.

    Examples
    --------
    >>> model = eomgen.build("examples/four_bar/scene.toml")
    >>> model.live("four_bar_live.html").name
    'four_bar_live.html'
    """
    target = None if path is None else check_name(Path(path))
    if target is not None:
        check_writable(target)
    check_supported(model.library.layout, model.name)
    text = live_page(model, simulate(model) if solution is None else solution)
    if target is None:
        return InlineAnimation(text)
    write_text(target, text)
    return target


def live_page(model: CompiledModel, solution: Solution) -> str:
    """Return the HTML text of a live page for a model and a run, whose values the page starts with; see ``live``."""
    held = _held(model, solution)
    library = _library(model, str(solution.metadata["method"]))
    check_supported(library.layout, model.name)
    module = web_module(library, left_to_stepper=jumps_known(library))
    seen = solution.poses_and_scenery
    data = packed(solution, seen, 121)  # pictures of the run by which the first view is laid out
    data["live"] = _live_data(model, solution, library, module, held, seen.scenery)
    data["success"] = True
    parts = {name: f"pictures/{file}" for name, file in SCRIPTS.items() if name != "page"}
    return page_of("pages/live.html", parts | _OF_LIVE, data, str(solution.metadata.get("version", "")))


def _library(model: CompiledModel, method: str) -> Library:
    """Return the library with the stepper of a method and the functions that a page evaluates, compiled from C. Waits
    for the compiler if necessary. Raises ModelError if the method cannot run on the scene."""
    layout = model.library.layout
    facts = layout["facts"]
    absent: tuple[str, ...] = () if layout["outputs"] else ("outputs",)
    absent += () if model.multipliers else ("constraint", "constraint_velocity", "constraint_jacobian", "mass")
    wanted = [name for name in FUNCTIONS[2:] if name not in absent]
    needed = terms_of(method, facts["constraints"], facts["internal_states"], not facts["ill_scaled"])
    terms = tuple(dict.fromkeys((*wanted, *needed)))
    library = compiled_or_same(model.stepper(method, Selection(terms)))
    if library.successor is not None:  # on the tape engine until the compiler is done
        library.successor.wait()
        library = compiled_or_same(library)
    if not library.layout["method"]:
        fault = f"{method} cannot run on this scene: {library.layout['stepper_refused']} [E0860]"
        raise ModelError(Problem(model.name, fault, "another method"))
    return library


def _held(model: CompiledModel, solution: Solution) -> dict[str, float]:
    """Return the inputs that a run holds constant. Raises UsageError for functions and tables."""
    held = {}
    for name, signal in solution.metadata["inputs"].items():
        if not isinstance(signal, int | float):
            fault = f"the input {name} of the run is a {signal}"
            fault = f"{fault}, and a page has constant inputs and the scene's formulas [E0959]"
            hint = f"a formula or a curve of the scene for {name}, or a number"
            raise UsageError(Problem(f"input {name}", fault, hint))
        held[name] = float(signal)
    return held


def _live_data(
    model: CompiledModel,
    solution: Solution,
    library: Library,
    module: WebModule,
    held: Mapping[str, float],
    scenery: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the data of a page besides the picture as JSON types: module, state, sliders, plots and texts. ``held``
    are the constant inputs of the run by name, ``scenery`` the visible parts."""
    metadata, layout = solution.metadata, library.layout
    names = [name for name, _ in module.blocks]
    p = np.array([metadata["parameters"][name] for name in model.parameters])
    extent = _extent(solution)
    bodies = {name: number for number, name in enumerate(model.bodies)}
    axes = [
        {
            **{key: axis[key] for key in ("x", "deflections", "rotations", "pairs", "shortening", "q_start")},
            "body": bodies[axis["name"]],
            "modes": int(np.shape(axis["deflections"])[-1]),
        }
        for axis in scenery.get("axes", ())
    ]
    beams = [
        {"nodes": [bodies[node] for node in beam["nodes"]], "pieces": pieces_of(len(beam["nodes"]) - 1)}
        for beam in scenery.get("beams", ())
    ]
    settings = metadata["settings"]
    return {
        "module": base64.b64encode(gzip.compress(module.code, mtime=0)).decode("ascii"),
        "blocks": [list(block) for block in module.blocks],
        "bodies": len(model.bodies),
        "base": "base" in [function["name"] for function in layout["functions"]] and "base" in names,
        "axes": axes,
        "beams": beams,
        "factors": [
            {name: getattr(factor, name) for name in ("group", "q_start", "q_size", "v_start", "v_size")}
            for factor in model.factors
        ],
        "settings": [float(settings[item["name"]]) for item in layout["method"]["settings"]],
        "step": float(metadata["step"]),
        "t": float(solution.t[0]),
        "duration": float(metadata["t_end"]) - float(solution.t[0]),
        "parameters": p.tolist(),
        "held": [float(held[name]) if name in held else None for name in model.inputs],
        "q": solution.q[0].tolist(),
        "v": solution.v[0].tolist(),
        "z": solution.z[0].tolist(),
        "extent": extent,
        "sliders": sliders_of(model, solution, p, held, extent),
        "plots": _plots(model, solution, names),
        "events": [row["name"] for row in layout["method"].get("events", {}).get("rows", ())],
        "stops": [20],  # statuses with which an event ends the motion
        "method": f"{metadata['method']}, steps of {metadata['step']:.6g} s",
        "error": _error(solution),
        "note": _note(model, solution),
    }


def _extent(solution: Solution) -> float:
    """Return the size of the machine at the start, m; 1 for a point."""
    places = np.array([pose[0, 4:] for pose in solution.poses.values()])
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    return size if np.isfinite(size) and size > COMPUTED else 1.0


def _error(solution: Solution) -> str:
    """Return the estimated error of the run, in words."""
    error = solution.error
    if error.worst is None:
        return f"The error of the run with the scene's values is not known: {error.reason}"
    end = float(solution.t[-1])
    return f"Estimated error of the run with the scene's values, to t = {end:.6g} s: {error.worst}"


def _note(model: CompiledModel, solution: Solution) -> str:
    """Return remarks on limits of the page."""
    notes = []
    if model.description.joints:
        notes.append("Bodies have absolute coordinates, so there are no sliders of initial positions. [W0055]")
    if "equilibrium" in str(solution.metadata.get("start", "")):
        notes.append("The motion starts at the equilibrium of the scene's values, also if parameters differ. [W0056]")
    if not solution.success:
        notes.append(f"The run with the scene's values ended early: {solution.message} [W0057]")
    elif told := [str(finding) for finding in solution.findings if finding.severity == WARNING]:
        notes.append(f"The run with the scene's values says: {'; '.join(told)}. [W0265]")
    return " ".join(notes)


def _plots(model: CompiledModel, solution: Solution, blocks: Sequence[str]) -> list[dict[str, Any]]:
    """Return the plots of a page as JSON types: outputs by unit, ``CURVES`` in each, and energies. ``blocks`` are the
    names of the blocks that the module fills."""
    plots: list[dict[str, Any]] = []
    offset = 0
    by_unit: dict[str, list[dict[str, Any]]] = {}
    for item in model.library.layout["outputs"] if "outputs_y" in blocks else ():
        name, size, unit = item["name"], int(item["size"]), item["unit"]
        for k in range(size):
            label = name if size == 1 else f"{name} {'xyz'[k] if size == 3 else k}"
            by_unit.setdefault("" if unit == "1" else unit, []).append(
                {"name": label, "block": "outputs_y", "place": [offset + k]}
            )
        offset += size
    for unit, curves in by_unit.items():
        for first in range(0, len(curves), CURVES):
            part = curves[first : first + CURVES]
            names = {str(curve["name"]).partition(" ")[0] for curve in part}
            plots.append({"title": names.pop() if len(names) == 1 else "outputs", "unit": unit, "curves": part})
    if "energy_energy" in blocks:
        energies = [("kinetic", [0]), ("potential", [1]), ("total", [0, 1])]
        potential = float(solution.energy["potential"][0]) if "potential" in solution.energy else 0.0
        curves = [
            {"name": name, "block": "energy_energy", "place": places, "minus": 0.0 if name == "kinetic" else potential}
            for name, places in energies
        ]
        plots = [*plots[:7], {"title": "energies", "unit": "J", "curves": curves}]
    return plots
