"""One run of the command line: the scene is read, the model built and simulated, with progress on a terminal."""

from __future__ import annotations

import gc
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from eomgen.base.limits import doubt_settings
from eomgen.base.progress import terminal_bar
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import assignments, check_assigned, in_units
from eomgen.cli.printing import building, say_note
from eomgen.errors import Message, NumericalError, Problem, UsageError
from eomgen.scene.sources.register import all_options, takes
from eomgen.toolchain.profiles import PROFILE_VARIABLE

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.results.solution import Solution
    from eomgen.scene.scene import Scene

SCENE_OPTIONS = ("strict", "coordinates", *all_options())
#: Options of a run that may be given again when the run is resumed.
_OPEN = ("parameters", "inputs", "checkpoint", "checkpoint_every", "error_estimate")


def read_scene(path: str, options: dict[str, Any]) -> Scene:
    """Return the scene of a path, with notes printed, and read ``--set``, ``--input`` and ``--initial`` in ``options``.

    Parameters
    ----------
    options : dict
        Of ``scene_options`` and ``run_options``; the scene's options are removed from the dict. The texts of
        ``parameters`` and ``inputs`` become numbers by name in the scene's units; ``initial`` becomes the argument of
        runs, in which texts with a unit stay texts, or None.

    Returns
    -------
    Scene
    """
    from eomgen.pipeline import documents  # noqa: PLC0415  # imported when the arguments are known to be fine

    changes, signals = assignments("--set", options["parameters"]), assignments("--input", options["inputs"])
    starts = assignments("--initial", options["initial"])
    scene = documents.load_scene(path, **{name: options.pop(name) for name in SCENE_OPTIONS})
    say_notes(scene)
    check_assigned(scene, changes, signals, robot=takes(Path(path), "tunable"))
    options["parameters"] = in_units("--set", changes, scene.parameters)
    options["inputs"] = in_units("--input", signals, scene.inputs)
    options["initial"] = starts or None
    return scene


def say_notes(scene: Scene) -> None:
    """Print the notes that reading a scene has made, each once, to stderr, without silenced ones."""
    for note in dict.fromkeys(scene.notes):
        if Message(note).doubt not in doubt_settings(scene.parts).quiet:
            say_note(note)


def stand_in(scene: Scene, method: str | None) -> str:
    """Return words on the method that files step with if the method is ``auto``, which chooses at runs alone; else
    empty.

    Parameters
    ----------
    method : None: the scene's method
    """
    from eomgen.pipeline import methods  # noqa: PLC0415

    if (scene.simulation.method if method is None else method) != "auto":
        return ""
    return f", with steps by {methods.method_of(scene, method)} (auto chooses at runs alone)"


def run(scene: Scene, options: dict[str, Any], *, once: bool = False) -> tuple[Model, Solution]:
    """Build and simulate a scene with the options that ``read_scene`` has left, or resume a checkpoint; return both
    results. The model has the functions that runs call. ``once``: whether the model is for this run alone, so that the
    tape engine may step the model."""
    from eomgen.base.drawing_process import own_process  # noqa: PLC0415  # most verbs make no copies
    from eomgen.pipeline import pipeline  # noqa: PLC0415

    resumed, t_end = options.get("resume"), options["t_end"]
    shared = {name: options[name] for name in _OPEN if name in options}
    run_options = {name: value for name, value in options.items() if name not in (*_OPEN, "resume", "t_end", "profile")}
    method = run_options["method"] if resumed is None else _method_of(resumed, run_options)
    with building(scene.name), own_process():
        steps = _steps(scene, options) if once and resumed is None else None
        model = pipeline.build_for_run(scene, method, run_options.get("start"), options["profile"], steps=steps)
    if model.nv >= 10_000:  # the derivation leaves reference cycles: 30 MB for 60 000 components
        gc.collect()
    with terminal_bar(scene.name) as progress:
        if resumed is None:
            return model, model.simulate(t_end, **run_options, **shared, progress=progress)
        return model, model.resume(resumed, t_end, **shared, progress=progress)


def _steps(scene: Scene, options: dict[str, Any]) -> float | None:
    """Return the number of steps of a run that may be stepped by the tape engine, None if the engine may not step the
    run: the profile is chosen by the user, later runs go on from a checkpoint, or the steps follow from a tolerance."""
    chosen = click.get_current_context().get_parameter_source("profile") is not ParameterSource.DEFAULT
    if chosen or os.environ.get(PROFILE_VARIABLE) or options["checkpoint"] or options["tolerance"] is not None:
        return None
    simulation = scene.simulation
    duration: float = simulation.duration if options["t_end"] is None else options["t_end"]
    step: float = simulation.step if options["step"] is None else options["step"]
    return abs(duration) / step if step else None  # a step of 0 is refused by the run


def _method_of(file: str, options: dict[str, Any]) -> str:
    """Return the method of a checkpoint's run. Raises UsageError if an option in `options` is not None: the run has
    settled all of these, and the caller leaves out options that stay open."""
    from eomgen.simulation.checkpoint import Checkpoint  # noqa: PLC0415

    fixed = [
        f"--{'largest-step' if name == 'settings' else name.replace('_', '-')}"
        for name, value in options.items()
        if value is not None
    ]
    if fixed:
        fault = "the run that goes on has its method, step and rows settled [E0203]"
        raise UsageError(Problem(", ".join(fixed), fault, "--resume without them; --t-end may be later"))
    return str(Checkpoint.load(Path(file)).run["method"])


def outcome_code(solution: Solution) -> int:
    """Return the exit code for how a run ended."""
    return 0 if solution.success else INTERRUPTED if solution.interrupted else NumericalError.exit_code
