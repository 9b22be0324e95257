"""The public verbs derive and build: a scene is read, its System derived and written as C, and the C compiled to
the library of a model."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

from eomgen.base.calls import checked_call
from eomgen.base.data import without_garbage_collection
from eomgen.base.messages import log_notes
from eomgen.errors import Message
from eomgen.pipeline.documents import as_document, read
from eomgen.pipeline.front_end import Document
from eomgen.pipeline.methods import method_name
from eomgen.pipeline.readings import record_of
from eomgen.pipeline.requests import LibraryRequest, ModelRequest, checked_terms
from eomgen.system.terms import REST, UNRESISTED
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.pipeline.documents import Described
    from eomgen.pipeline.model import Model
    from eomgen.pipeline.programs import BeginLibrary
    from eomgen.system.system import System
    from eomgen.toolchain.library import Library


@checked_call("a scene or the path of one")
def derive(scene: Described, terms: Sequence[str] | None = None) -> System:
    """Derive the symbolic System of a scene in separated form.

    Parameters
    ----------
    scene : Scene, path, or mapping
        As in ``build``; a Hamiltonian system takes no ``terms``.
    terms : sequence of str, optional
        The functions wanted, of which functions that the scene cannot have are left out. By default the scene's own
        list; without such a list, or for an empty list, all that the scene can have, without functions that are derived
        by name alone and, of large scenes, dense matrices. Functions of events are added.

    Returns
    -------
    System
        Functions on one tape, with SymPy and LaTeX of each term.

    Raises
    ------
    UsageError, DescriptionError, ModelError, FileError
        UsageError for an unknown term; DescriptionError for a faulty scene, or if a drive, or the law of the base,
        jumps at default parameters within the scene's duration; ModelError for constraints that contradict each other.

    Examples
    --------
    >>> system = eomgen.derive("examples/four_bar/scene.toml", terms=["mass"])
    >>> list(system.functions)
    ['mass']
    """
    terms = checked_terms(terms)
    document, front_end, kind = read(scene, terms=terms)
    if kind is not None:
        return front_end.derive(document, None)
    from eomgen.pipeline.programs import derive_system  # noqa: PLC0415  # each stage of the road is imported when reached

    return derive_system(document, front_end, terms)


def _options_of_load() -> dict[str, str]:
    """Return the remedy for each option of ``load`` that is given to ``build``."""
    from eomgen.scene.sources.register import all_options  # noqa: PLC0415

    return {name: f"eomgen.build(eomgen.load(path, {name}=...))" for name in all_options()}


@checked_call(
    "a scene or the path of one",
    _options_of_load,
    path="scene",
    dtype="real",
    precision="real",
    coordinates="eomgen.build(eomgen.load(path, coordinates=...))",
    task_frames="eomgen.build(eomgen.load(path, task_frames=...))",
    strict="eomgen.build(eomgen.load(path, strict=...))",
    parameters="tunable = true in the scene, and eomgen.build(scene).simulate(parameters=...)",
    **dict.fromkeys(("optimize", "optimise", "optimization", "flags"), "profile"),
    **{name: f"eomgen.build(scene).simulate({name}=...)" for name in ("step", "tolerance", "t_end", "dt", "inputs")},
)
def build(
    scene: Described,
    terms: Sequence[str] | None = None,
    *,
    method: str | None = None,
    profile: str = STANDARD_PROFILE,
    real: str | None = None,
) -> Model:
    """Return the compiled model of a scene, from the cache if the scene has not changed.

    If numbers alone have changed, the machine code of the earlier model is taken from the cache, as a rule.

    Parameters
    ----------
    scene : Scene, path, or mapping
        A mapping holds the data of a scene file: ``{"format": 1, "name": ..., "bodies": {...}, ...}``. A Hamiltonian
        system gives a model of its own kind, and takes ``method`` and ``profile`` alone (not ``instant``).
    terms : sequence of str, optional
        Functions wanted, of which functions that the scene cannot have are left out. By default the scene's own list;
        without such a list, or for an empty list, all that the scene can have, without functions that are derived by
        name alone and, of large scenes, dense matrices. Fewer compile faster.
    method : str, optional
        Method whose stepper is compiled in, and the method that ``simulate`` uses by default; the scene's by default.
        Steppers of other methods are compiled when ``simulate`` asks for such a method. ``auto``: each run chooses, see
        ``simulate``. A method that cannot run on the scene is refused by ``simulate``, not here.
    profile : str
        ``fast`` (this processor), ``reproducible`` (same bits everywhere), ``quick`` (compiles fastest) or ``instant``:
        the functions are evaluated by a tape engine at once, to the bits of ``reproducible``, and a compiled library
        of the default profile (``fast`` if that is ``instant``) takes over between two calls or runs when the compiler
        is done. A compiled library in the cache is taken at once. ``fast`` by default, unless the environment variable
        ``EOMGEN_PROFILE`` named another when eomgen was imported.
    real : str
        Number type of the compiled code: ``double`` or ``float``; the scene's by default.

    Returns
    -------
    Model
        The compiled scene.

    Raises
    ------
    UsageError, DescriptionError, ModelError, ToolchainError, FileError
        UsageError for an unknown term, method or number type; ToolchainError for an unknown profile, or without a
        compiler if the cache has no library.

    Warns
    -----
    RuntimeWarning
        Some motion of the joints moves no mass, so forward dynamics has no answer; names the joints.

    Examples
    --------
    >>> model = eomgen.build("examples/four_bar/scene.toml")
    >>> model.nq, model.multipliers
    (3, ('rocker_pin: origins meet along x', 'rocker_pin: origins meet along y'))
    """
    terms = checked_terms(terms)
    document, front_end, kind = read(scene, terms=terms, real=real not in (None, "double"))
    if kind is not None:
        return cast("Model", kind.build(document, method, profile))
    with without_garbage_collection():
        model = build_model(ModelRequest(document, front_end, terms, method, profile, real))
    if document is not scene:  # read here
        log_notes(model.name, model.notes)
    return model


def build_model(request: ModelRequest, steps: float | None = None) -> Model:
    """Return the compiled model of a request: its library, from the cache or made, and a supplier of the rest.

    Warns RuntimeWarning if some motion moves no inertia.

    Parameters
    ----------
    steps : as of ``build_for_run``
    """
    library = make_library(request.whole_library, steps)
    accelerations = any(function["name"] == "forward_dynamics" for function in library.layout["functions"])
    for note in library.layout["notes"]:
        if accelerations and Message(note).code in UNRESISTED:
            warnings.warn(f"{request.description.name}: {note}", RuntimeWarning, stacklevel=3)
    source = request.document, request.terms, request.method, request.profile, request.real
    from eomgen.pipeline.model import Model  # noqa: PLC0415  # while compilers run, if there is no library
    from eomgen.pipeline.suppliers import Supplier  # noqa: PLC0415  # likewise

    again = request.again or partial(build_in, None, *source, start=request.start)
    supplier = Supplier(request, library, make_library, build_model, build_reproducible, again)
    return Model(request.description, library, supplier.stepper, supplier)


def make_library(request: LibraryRequest, steps: float | None = None) -> Library:
    """Return a library from the cache, else compiled, or copied from one of equal structure with other numbers.
    ``steps``: as of ``build_for_run``."""
    library = request.find()
    if library is None:
        from eomgen.pipeline.libraries import new_library  # noqa: PLC0415  # a library of the cache is not compiled

        library = new_library(request, partial(write_c, request), steps)
    return library


def write_c(request: LibraryRequest, begin: BeginLibrary) -> tuple[Program, str]:
    """Return the Program of the System of a document, all data of its C, and the reason if there is no stepper."""
    from eomgen.codegen.targets.register import C  # noqa: PLC0415  # each stage of the road is imported when reached
    from eomgen.pipeline.programs import write_program  # noqa: PLC0415

    return write_program(request, C, build_reproducible, for_runs=True, begin=begin)


def build_reproducible(document: Document, terms: Sequence[str]) -> Model:
    """Return a model from which values of parameters or states are found: the same bits everywhere."""
    return build(document, terms, profile="reproducible", real="double")


def build_in(
    cache: Path | None,
    scene: Described,
    terms: Sequence[str] | None = None,
    method: str | None = None,
    profile: str = STANDARD_PROFILE,
    real: str | None = "double",
    *,
    start: str = "",
) -> Model:
    """Return the compiled model of a scene as ``build`` does, with libraries in the folder ``cache``, None: the user's
    cache.

    Parameters
    ----------
    start : as of ``Selection``, if the model is built for runs or linear models alone
    """
    asked, libraries = checked_terms(terms), Cache(cache) if cache else None
    return build_model(ModelRequest(*as_document(scene), asked, method, profile, real, start, libraries))


def build_for_run(
    scene: Described,
    method: str | None = None,
    start: str | None = None,
    profile: str = STANDARD_PROFILE,
    *,
    steps: float | None = None,
) -> Model:
    """Return the compiled model of a scene with the functions that runs call; other functions are compiled at first
    use.

    Parameters
    ----------
    method, start : of the runs; the scene's by default
    profile : as of ``build``
    steps : of the only run, which may be stepped by the tape engine: if the library is not in the cache, the method
        does not choose its steps, and the run is expected to end on the engine before the compilers would end
    """
    stored = record_of(scene)
    document, front_end = as_document(stored.lean if stored else scene)
    described = front_end.describe(document)
    if steps is not None:
        from eomgen.integrators.families.register import method_named  # noqa: PLC0415

        steps = None if method_named(method_name(described, method)).chooses_steps else steps
    start = start or described.simulation.start
    return build_model(ModelRequest(document, front_end, None, method, profile, None, start), steps)


def build_for_rest(scene: Described, profile: str = STANDARD_PROFILE, *, points: int = 1) -> Model:
    """Return the compiled model of a scene with the functions that linear models about rest call, without a stepper;
    other functions are compiled at first use.

    Parameters
    ----------
    profile : as of ``build``
    points : number of linear models, each with some fifty evaluations, which may be made on the tape engine as the
        steps of ``build_for_run``
    """
    stored = record_of(scene)
    document = as_document(stored.lean if stored else scene)
    return build_model(ModelRequest(*document, None, None, profile, "double", REST), 50.0 * points)
