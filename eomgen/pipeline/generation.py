"""The verb generate: models and steppers, or controllers, as folders of C that stand alone."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from eomgen.base.calls import checked_call
from eomgen.base.data import replace
from eomgen.base.messages import shown
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.pipeline.documents import read
from eomgen.pipeline.pipeline import build_reproducible
from eomgen.pipeline.requests import ProgramRequest, check_real, checked_terms
from eomgen.pipeline.scenes import SCENES
from eomgen.system.terms import Selection

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.codegen.targets.target import Target
    from eomgen.pipeline.documents import Described
    from eomgen.pipeline.front_end import Document, FrontEnd
    from eomgen.scene.scene import Scene

#: Endings of files of code, which folders have not.
_OF_FILES = (".c", ".h", ".zip", ".py", ".so", ".m")


@checked_call('a scene and a folder, eomgen.generate("scene.toml", "model_c")', path="folder", out="folder")
def generate(
    scene: Described,
    folder: str | Path,
    terms: Sequence[str] | None = None,
    method: str | None = None,
    *,
    target: str = "c",
    real: str | None = None,
    parameters: Mapping[str, float | str] | None = None,
    only: str | None = None,
    uniform: bool = False,
) -> list[Path]:
    """Write a scene's model and stepper, or its controller, as a folder of C that stands alone.

    If the scene's own method cannot run on the scene, or ``terms`` lacks functions that its steps call, the functions
    are written without a stepper. If the scene starts at static equilibrium, so does the C; a RuntimeWarning and the
    README report that none was found.

    Parameters
    ----------
    scene : Scene, path, or mapping
        As in ``build``.
    folder : path
        New, empty, or written by eomgen before: then earlier files are replaced, or removed if not written again.
    terms : sequence of str, optional
        As of ``build``.
    method : str, optional
        As of ``build``: the method whose stepper is written; ``generalized_alpha`` for ``auto``.
    target : str
        The language: ``c``; ``casadi`` or ``acados``, whose files have one step with derivatives in place of a stepper,
        if there is such a step; a named ``method`` without it is a UsageError or ModelError; ``ros2`` or ``cortex-m4``,
        controllers around the inverse dynamics, without a stepper; ``cuda``, the C with a kernel for each function, for
        GPUs; or a language of another distribution.
    real : str
        Number type that the compile command of the folder chooses: ``double`` or ``float``; the scene's by default. The
        files serve both.
    parameters : mapping
        Values of tunable parameters, as in ``simulate``: the defaults of the C, from which its initial state follows.
    only : str
        ``controller``: write the controller of the scene without the machine, in C; ``terms``, ``method`` and
        ``uniform`` are then refused.
    uniform : bool
        Write ``NAME_uniform.c`` with its headers, too: all functions and steps with one signature, equal for all
        models; ``target`` is then ``c``.

    Returns
    -------
    list of Path
        The written files, ``README.md`` and ``manifest.json`` included, in the order of their names.

    Raises
    ------
    UsageError, DescriptionError, ModelError, ToolchainError, FileError
        UsageError for a law in Python, which C cannot hold, or a new ``folder`` with the ending of a file, as ``.c`` or
        ``.zip``; ModelError for a named method that cannot run on the scene; FileError for a folder with files that
        eomgen did not write.

    Examples
    --------
    >>> files = eomgen.generate("examples/four_bar/scene.toml", "four_bar_c")
    >>> "four_bar.c" in {file.name for file in files}
    True
    """
    from eomgen.codegen.folder import write_folder  # noqa: PLC0415
    from eomgen.codegen.targets.register import target_named  # noqa: PLC0415
    from eomgen.pipeline.generated_defaults import with_interface  # noqa: PLC0415

    chosen = target_named(target)
    _check_folder(folder)
    terms = checked_terms(terms)
    of_scenes = {"terms": terms, "target": target != "c", "real": real not in (None, "double"), "uniform": uniform}
    _check_only(only, chosen, terms=terms, method=method, uniform=uniform or None)
    if uniform and chosen.name != "c":
        fault = f"one signature is written in C, not in {chosen.language} [E0544]"
        raise UsageError(Problem("uniform", fault, "target c"))
    document, front_end, kind = read(scene, **of_scenes, parameters=parameters)
    if kind is not None:
        _check_scene(document, only)
        return kind.generate(document, folder, method)
    check_real(real)
    asked = {key: value for key, value in (("real", real), ("method", method)) if value is not None}
    if asked and not (chosen.steppers or chosen.takes_method):
        fault = f"the files of {chosen.name} have no stepper and one number type [E2251]"
        raise UsageError(Problem(" and ".join(asked), fault, f"leave {' and '.join(asked)} out"))
    if only is None:
        program, refusal = exported_program(document, front_end, chosen, terms, method, parameters=parameters)
        if refusal and method and chosen.steppers:
            raise ModelError(f"{method} cannot run on this scene: {refusal} [E0860]", "another method, or no method")
    else:
        _check_exported(program := _controller_program(document, front_end, parameters))
        program = with_interface(program, front_end.describe(document))
    defaults = {**program.defaults, **asked, "metadata": getattr(document, "metadata", {})}
    program = replace(program, defaults=defaults, uniform=uniform)
    files = chosen.files(program, method) if chosen.takes_method else chosen.files(program)
    written = write_folder(files, folder)
    return [written / name for name in sorted(files)]


def exported_program(
    document: Document,
    front_end: FrontEnd,
    target: Target,
    terms: Sequence[str] | None = None,
    method: str | None = None,
    *,
    parameters: Mapping[str, float | str] | None = None,
) -> tuple[Program, str]:
    """Return the Program of files that stand alone, and the reason if the Program has no stepper, else empty text.

    The Program has the equilibrium as start if the scene asks for this, and names and ranges of coordinates.

    Parameters
    ----------
    target : language, which decides the terms
    terms, method, parameters : as of ``generate``

    Raises
    ------
    UsageError
        Laws in Python; terms that the scene does not have.
    """
    from eomgen.pipeline.generated_defaults import with_equilibrium_start, with_interface  # noqa: PLC0415
    from eomgen.pipeline.programs import write_program  # noqa: PLC0415

    taken = None if (wanted := target.terms(terms)) is None else tuple(wanted)
    request = ProgramRequest(document, front_end, Selection(taken), method)
    program, refusal = write_program(request, target, build_reproducible, parameters=parameters)
    _check_exported(program)
    if program.defaults["start"] == "equilibrium":
        program = with_equilibrium_start(program, partial(build_reproducible, document), parameters)
    return with_interface(program, front_end.describe(document)), refusal


def _controller_program(
    document: Document, front_end: FrontEnd, parameters: Mapping[str, float | str] | None
) -> Program:
    """Return the Program of a scene's controller, with the given values of the scene's parameters."""
    from eomgen.codegen.convert import to_program  # noqa: PLC0415
    from eomgen.integrators.events import controller_data  # noqa: PLC0415
    from eomgen.mechanics.controller import derive_controller  # noqa: PLC0415
    from eomgen.pipeline.generated_defaults import with_parameters  # noqa: PLC0415

    prepared = front_end.prepared(document, build_reproducible)
    if front_end is not SCENES:
        _check_scene(document, "controller")
    if parameters:
        prepared = with_parameters(prepared, front_end.describe(document), parameters)
    system = derive_controller(cast("Scene", prepared))
    return replace(to_program(system), controller=controller_data(system))


def _check_only(only: str | None, target: Target, **others: object) -> None:
    """Raise UsageError for an unknown part ``only``, a target other than C, or options of whole models (``others``)
    with it."""
    if only is None:
        return
    if only != "controller":
        raise UsageError(Problem("only", f"no part of a scene is called {shown(only)} [E0545]", "controller"))
    if target.name != "c":
        fault = f"a controller alone is written in C, not in {target.language} [E0546]"
        raise UsageError(Problem("only", fault, "target c"))
    for name, value in others.items():
        if value is not None:
            fault = f"{name} belongs to the whole machine, and only the controller is generated [E0547]"
            raise UsageError(Problem(name, fault, f"leave {name} out, or only"))


def _check_exported(program: Program) -> None:
    """Raise UsageError for a Program without functions, and for laws in Python, which exist in this process alone."""
    if not program.functions:
        raise UsageError(f"{program.prefix} has none of the functions that the terms name [E2465]", "no terms, for all")
    for source in program.sources:
        if law := source.python:
            fault = f"the law is in Python, {law.function} in {Path(law.file).name}: export needs C [E0548]"
            raise UsageError(Problem(law.label, fault, 'source = "law.c", with the function in C'))


def _check_scene(document: Any, only: str | None) -> None:
    """Raise UsageError if the controller of a document that is not a mechanical scene is wanted."""
    if only is not None:
        name = getattr(document, "name", "this")
        fault = f"{name} is not a mechanical scene, and only scenes have a controller [E0549]"
        raise UsageError(Problem("only", fault, "leave it out"))


def _check_folder(folder: str | Path) -> None:
    """Raise UsageError for a folder that is not a path, or that has the ending of a file of code and does not exist."""
    if not isinstance(folder, str | os.PathLike):
        fault = f"the path of a folder is needed, not {type(folder).__name__} [E2169]"
        raise UsageError(Problem("folder", fault, "generate(scene, folder), the scene first"))
    from eomgen.scene.sources.register import own_endings  # noqa: PLC0415

    path = Path(folder)
    if path.suffix.lower() in (*_OF_FILES, *own_endings()) and not path.is_dir():
        fault = f"{path.name} is the name of a file, and a folder of several files is written [E0550]"
        raise UsageError(Problem(str(folder), fault, f"the folder {path.with_suffix('').name}"))
