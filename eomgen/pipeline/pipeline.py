"""The public verbs load, derive, generate and build."""

from __future__ import annotations

import functools
import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from eomgen.base.calls import checked_call, names_of
from eomgen.base.data import dataclass, replace, without_garbage_collection
from eomgen.base.extensions import extensions, loaded
from eomgen.base.messages import Log, log_notes, shown
from eomgen.errors import DescriptionError, EomgenError, Message, ModelError, Problem, ToolchainError, UsageError
from eomgen.pipeline.content import fingerprint, library_content
from eomgen.pipeline.front_end import Document, FrontEnd, file_kinds, is_scene, other_document
from eomgen.pipeline.readings import StoredScene, record_of, record_of_document, store, stored_scene
from eomgen.pipeline.scenes import SCENES, opened
from eomgen.system.terms import REST, TERMS, UNRESISTED, Selection, linear_terms, nearest_term
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.codegen.targets.target import Names, Target
    from eomgen.integrators.families.register import Method
    from eomgen.pipeline.libraries import EarlyTexts
    from eomgen.pipeline.model import Model
    from eomgen.scene.scene import Scene
    from eomgen.system.branches import Branches
    from eomgen.system.description import Description, Simulation
    from eomgen.system.system import Sample, System
    from eomgen.toolchain.builder import Builder, LaneFiles
    from eomgen.toolchain.compiler import RunningCompilers
    from eomgen.toolchain.library import LaneLibrary, Library

    #: From a System, the data of a method, names of functions and names of the target to a Program whose texts are
    #: known, if there is one.
    BeginLibrary = Callable[[System, Mapping[str, Any], Sequence[str], Names], Program | None]
    #: A scene, the path of a scene, nested data in the form of a scene file, or the document of another front end.
    Described = Scene | str | os.PathLike[str] | Mapping[str, Any] | Document

_LOG = Log(__name__)


@dataclass(frozen=True)
class Stored:
    """Libraries of a file, by selection and method, and the call that loads the file."""

    library: Callable[[Selection, str], Library | None]
    again: partial[Model]


#: Options of ``load`` as ``build`` reads a file.
_DEFAULTS: Mapping[str, Any] = {"strict": False, "coordinates": None, "task_frames": ()}
#: Endings of files of code, which folders have not.
_OF_FILES = (".c", ".h", ".zip", ".py", ".so", ".m")


@checked_call('eomgen.load("scene.toml")')
def load(
    path: Described,
    *,
    strict: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    task_frames: Sequence[str] = (),
    **options: Any,
) -> Scene:
    """Read a scene from a ``.toml``, ``.urdf`` or ``.sdf`` file or an ``.xml`` file of MuJoCo, or from its data.

    Parameters
    ----------
    path : path, mapping or Scene
        A mapping holds the data of a scene file; a Scene is returned unchanged.
    strict : bool
        Refuse elements that an importer would leave out with a note.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of the file's own (a URDF's are joint).
    task_frames : sequence of str
        Bodies and frames of the terms of frames (``frame_jacobians`` and others), in place of the file's own;
        a URDF has all.
    **options
        For URDF: ``root``, whether the root link is ``fixed`` to the base or ``free``; ``lock``, moving joints to be
        fixed at zero; ``limits``, to turn limits of position into compliant stops, as hard as the joints' largest
        efforts ask for; ``friction``, to take the dry friction of joints, regularised at 0.01 rad/s and 1 mm/s;
        ``actuated``, to give every moving joint of one coordinate an effort input of its own name;
        ``transmissions``, to make the efforts of actuators inputs, which transmissions carry to the joints;
        ``tunable``, links whose mass, centre of mass and inertia become tunable parameters.
        For MJCF: ``keyframe``, the start; ``mocap``, to move mocap bodies by motions from outside; ``limits`` and
        ``friction``.
        For SDF: ``weld``, links and frames that are fixed to the base at their places; ``packages``, folders of
        packages and models that the file names, each as ``NAME=FOLDER``; ``lock``, ``limits``, ``friction`` and
        ``actuated``.

    Returns
    -------
    Scene
        The checked scene.

    Raises
    ------
    FileError, DescriptionError, UsageError

    Examples
    --------
    >>> eomgen.load("examples/four_bar/scene.toml").name
    'four_bar'
    """
    given = {"strict": strict, "coordinates": coordinates, "task_frames": task_frames, **options}
    if (stored := stored_scene(path, given)) is not None:
        log_notes(stored.scene.name, stored.scene.notes)
        return stored.scene
    other = other_document(path, given)
    if other is not None:
        return cast("Scene", other[1])
    with without_garbage_collection():
        scene = load_scene(path, strict=strict, coordinates=coordinates, task_frames=task_frames, **options)
    log_notes(scene.name, scene.notes)
    return scene


def load_scene(
    path: Described,
    *,
    strict: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    task_frames: Sequence[str] = (),
    **options: Any,
) -> Scene:
    """Read a mechanical scene; see ``load``."""
    given = {"strict": strict, "coordinates": coordinates, "task_frames": task_frames, **options}
    if (stored := stored_scene(path, given)) is not None:
        return stored.scene
    if isinstance(path, str | os.PathLike):
        from eomgen.base.files import digests_of_files  # noqa: PLC0415  # each stage of the road is imported when reached
        from eomgen.scene import load as reader  # noqa: PLC0415

        try:
            with digests_of_files() as files:
                scene = reader.load(
                    Path(path), strict=strict, coordinates=coordinates, task_frames=task_frames, **options
                )
        except DescriptionError as error:
            method = partial(reader.method_of, Path(path), strict=strict, **options)
            raise _with_method_problems(error, method) from None
        _check_method(scene)
        store(path, given, scene, SCENES.describe(scene), files)
        return scene
    from eomgen.scene.sources.register import checked_options  # noqa: PLC0415

    checked_options(None, options)
    if not task_frames:
        return _given_scene(path, coordinates)
    if isinstance(path, Mapping):
        names = [task_frames] if isinstance(task_frames, str) else list(task_frames)
        return _given_scene({**path, "task_frames": names}, coordinates)
    fault = "the task frames of a Scene are chosen where it is read [E0543]"
    raise UsageError(Problem("task_frames", fault, "the path or the mapping that it was read from"))


@checked_call("a scene or the path of one")
def derive(scene: Described, terms: Sequence[str] | None = None) -> System:
    """Derive the symbolic System of a scene in separated form.

    Parameters
    ----------
    scene : Scene, path, or mapping
        As in ``build``.
    terms : sequence of str, optional
        The functions wanted; the scene's own list, or all that it can use, by default.

    Returns
    -------
    System
        Functions on one tape, with SymPy and LaTeX of each term.

    Raises
    ------
    UsageError, DescriptionError, ModelError
        DescriptionError if a drive, or the law of the base, jumps.

    Examples
    --------
    >>> system = eomgen.derive("examples/four_bar/scene.toml", terms=["mass"])
    >>> list(system.functions)
    ['mass']
    """
    terms = checked_terms(terms)
    other = other_document(scene, {"terms": terms})
    if other is not None:
        return other[0].front_end.derive(other[1], None)
    from eomgen.formula.motion_faults import jumps  # noqa: PLC0415

    document, front_end = as_document(scene)
    described = front_end.describe(document)
    if problems := jumps(described.laws, described.values({}), 0.0, described.simulation.duration):
        raise DescriptionError(problems)
    began = time.perf_counter()
    system = front_end.derive(document, terms)
    seconds, functions = time.perf_counter() - began, ", ".join(system.functions)
    _LOG.info("derived %s in %.2f s: %s", system.name, seconds, functions)
    return system if system.defaults else replace(system, defaults=vars(described.simulation))


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

    If the scene starts at static equilibrium, so does the C; a RuntimeWarning and its README report that none was
    found.

    Parameters
    ----------
    scene : Scene, path, or mapping
        As in ``build``.
    folder : path
        New, empty, or written by eomgen before.
    terms : sequence of str, optional
        As of ``build``.
    method : str, optional
        As of ``build``: the method whose stepper is written.
    target : str
        The language: ``c``, or one that another distribution gives, which may have no steppers.
    real : str
        Number type that the compile command of the folder chooses: ``double`` or ``float``; the scene's by default.
        The files serve both.
    parameters : mapping
        Values of tunable parameters, as in ``simulate``: the defaults of the C, from which its initial state follows.
    only : str
        ``controller``: write the controller of the scene without the machine.
    uniform : bool
        Write ``NAME_uniform.c``, too: all functions and steps with one signature, equal for all models.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    UsageError, ModelError, FileError

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
    other = other_document(scene, {**of_scenes, "parameters": parameters})
    _check_only(only, chosen, terms=terms, method=method, uniform=uniform or None)
    if uniform and chosen.name != "c":
        raise UsageError(
            Problem("uniform", f"one signature is written in C, not in {chosen.language} [E0544]", "target c")
        )
    if other is not None:
        _check_scene(other[1], only)
        return other[0].generate(other[1], folder, method)
    document, front_end = as_document(scene)
    _check_real(real)
    if only is None:
        program = exported_program(document, front_end, chosen, terms, method, parameters=parameters)[0]
    else:
        program = _controller_program(document, front_end, parameters)
        _check_exported(program)
        program = with_interface(program, front_end.describe(document))
    given = {key: value for key, value in (("real", real), ("method", method)) if value is not None}
    program = replace(program, defaults={**program.defaults, **given}, uniform=uniform)
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
    """Return the Program of files that stand alone, with the start and the names of its coordinates, and the reason if
    the Program has no stepper.

    Parameters
    ----------
    terms, method, parameters : as of ``generate``

    Raises
    ------
    UsageError
        Laws in Python.
    """
    from eomgen.pipeline.generated_defaults import with_equilibrium_start, with_interface  # noqa: PLC0415

    wanted = _selected(target.terms(terms))
    program, refusal = _program(document, front_end, wanted, method, target, parameters=parameters)
    _check_exported(program)
    if program.defaults["start"] == "equilibrium":
        program = with_equilibrium_start(program, partial(_reproducible, document), parameters)
    return with_interface(program, front_end.describe(document)), refusal


def _controller_program(
    document: Document, front_end: FrontEnd, parameters: Mapping[str, float | str] | None
) -> Program:
    """Return the Program of a scene's controller, with the given values of the scene's parameters."""
    from eomgen.codegen.convert import to_program  # noqa: PLC0415
    from eomgen.integrators.events import controller_data  # noqa: PLC0415
    from eomgen.mechanics.controller import derive_controller  # noqa: PLC0415
    from eomgen.pipeline.generated_defaults import with_parameters  # noqa: PLC0415

    described = front_end.describe(document)
    prepared = front_end.prepared(document, _reproducible)
    if front_end is not SCENES:
        _check_scene(document, "controller")
    if parameters:
        prepared = with_parameters(prepared, described, parameters)
    system = derive_controller(cast("Scene", prepared))
    return replace(to_program(system), controller=controller_data(system))


def _check_only(only: str | None, target: Target, **others: object) -> None:
    """Raise UsageError for a part that cannot be written alone, and for options of models together with it."""
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
    """Raise UsageError for laws in Python, which exist in this process alone."""
    for source in program.sources:
        if source.python is not None:
            name = Path(source.python.file).name
            fault = f"the law is in Python, {source.python.function} in {name}: export needs C [E0548]"
            raise UsageError(Problem(source.python.label, fault, 'source = "law.c", with the function in C'))


def _check_scene(document: Any, only: str | None) -> None:
    """Raise UsageError if the controller of a document that is not a mechanical scene is wanted."""
    if only is not None:
        name = getattr(document, "name", "this")
        fault = f"{name} is not a mechanical scene, and only scenes have a controller [E0549]"
        raise UsageError(Problem("only", fault, "leave it out"))


def _check_folder(folder: str | Path) -> None:
    """Raise UsageError for a folder that is not a path, or that has the name of a file of code."""
    if not isinstance(folder, str | os.PathLike):
        fault = f"the path of a folder is needed, not {type(folder).__name__} [E2169]"
        raise UsageError(Problem("folder", fault, "generate(scene, folder), the scene first"))
    from eomgen.scene.sources.register import own_endings  # noqa: PLC0415

    path = Path(folder)
    if path.suffix.lower() in (*_OF_FILES, *own_endings()) and not path.is_dir():
        fault = f"{path.name} is the name of a file, and a folder of several files is written [E0550]"
        raise UsageError(Problem(str(folder), fault, f"the folder {path.with_suffix('').name}"))


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

    Parameters
    ----------
    scene : Scene, path, or mapping
        A mapping holds the data of a scene file: ``{"format": 1, "name": ..., "bodies": {...}, ...}``.
    terms : sequence of str, optional
        Functions wanted; the scene's own list, or all that it can use, by default. Fewer compile faster.
    method : str, optional
        Method whose stepper is compiled in, and the method that ``simulate`` uses by default; the scene's by default.
        Steppers of other methods are compiled when ``simulate`` asks for such a method. ``auto``: each run chooses, see
        ``simulate``.
    profile : str
        ``fast`` (this processor), ``reproducible`` (same bits everywhere), ``quick`` (compiles fastest) or ``instant``:
        the functions are evaluated by a tape engine at once, to the bits of ``reproducible``, and the compiled library
        takes over between two calls or runs when the compiler is done. A compiled library in the cache is taken at
        once.
    real : str
        Number type of the compiled code: ``double`` or ``float``; the scene's by default.

    Returns
    -------
    Model
        The compiled scene.

    Raises
    ------
    UsageError, DescriptionError, ModelError, ToolchainError, FileError

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
    with without_garbage_collection():
        stored = record_of(scene) or stored_scene(scene, _DEFAULTS)
    other = None if stored else other_document(scene, {"terms": terms, "real": real not in (None, "double")})
    if other is not None:
        return cast("Model", other[0].build(other[1], method, profile))
    with without_garbage_collection():
        document, front_end = as_document(stored.lean if stored else scene)
        chosen = front_end.describe(document).simulation.real if real is None else real
        model = built_in(None, document, terms, method, profile, chosen)
    if document is not scene:  # read here
        log_notes(model.name, model.notes)
    return model


def built_in(
    cache: Path | None,
    scene: Described,
    terms: Sequence[str] | None = None,
    method: str | None = None,
    profile: str = STANDARD_PROFILE,
    real: str = "double",
    *,
    start: str = "",
    steps: float | None = None,
    stored: Stored | None = None,
) -> Model:
    """Return the compiled model of a scene as ``build`` does, with libraries kept in this folder, the user's cache by
    default.

    Parameters
    ----------
    start : as of ``Selection``, if the model is built for runs or linear models alone
    steps : as of ``built_for_run``
    stored : libraries of the file from which the model is loaded
    """
    terms = checked_terms(terms)
    from eomgen.integrators.families.register import terms_of  # noqa: PLC0415

    document, front_end = as_document(scene)
    described = front_end.describe(document)
    if method is not None and method != described.simulation.method:
        described = replace(described, simulation=replace(described.simulation, method=method))
    _check_real(real)
    from eomgen.toolchain.builder import Builder  # noqa: PLC0415
    from eomgen.toolchain.cache import Cache  # noqa: PLC0415

    builder = Builder(profile=profile, real=real, cache=None if cache is None else Cache(cache))
    own = _method_name(described, method)

    def of_method(name: str, selection: Selection, steps: float | None = None) -> Library:
        """Return the library with the stepper of a method, stored or made."""
        ready = None if stored is None else stored.library(selection, name)
        return ready or _library(document, front_end, selection, name, builder, steps)

    library = of_method(own, _selected(terms, start), steps)
    constrained = bool(library.layout["multipliers"])  # all rows of a scene may follow from its joints
    there = [function["name"] for function in library.layout["functions"]]
    mass = "mass" in there and not library.layout["facts"]["ill_scaled"]
    long = not constrained and not described.states and "iteration" in there

    def stepper(other: str, selection: Selection | None = None) -> Library:
        """Return a library with a method's stepper: of these functions, else of the functions that the stepper calls;
        of long trees without dense partials."""
        if selection is not None:
            return of_method(other, selection)
        needed = terms_of(other, constrained, bool(described.states), mass)
        wanted = [("iteration" if long and term == "partials" else term) for term in needed]
        return of_method(other, _selected(wanted))

    def in_lanes(library: Library, cdef: str, files_of: LaneFiles) -> LaneLibrary | str:
        """Return the stepper of a library for several trajectories side by side, or why there is none."""
        try:
            return builder.build_lanes(library, cdef, files_of)
        except ToolchainError as error:  # a model for runs alone needs no other library
            return error.problems[0].what

    def built(others: Sequence[str]) -> Model:
        return built_in(cache, document, tuple(dict.fromkeys(others)), method, profile, real)

    def in_complex(others: Sequence[str]) -> Library:
        """Return functions in complex numbers, without a stepper."""
        of_complex = Builder(profile=profile, real="complex", cache=None if cache is None else Cache(cache))
        return _library(document, front_end, _selected(others), _method_name(described, method), of_complex)

    for note in library.layout["notes"] if "forward_dynamics" in there else ():
        if Message(note).code in UNRESISTED:
            warnings.warn(f"{described.name}: {note}", RuntimeWarning, stacklevel=3)

    def branches() -> Branches:
        """Return the function that decides branches of the equations along runs."""
        from eomgen.system.branches import OF_RUNS, Branches  # noqa: PLC0415  # most scenes have none

        wanted = [name for name in OF_RUNS if name in TERMS and (name == "residual" or described.states)]
        wanted += ["outputs"] if described.outputs else []
        return Branches(front_end.derive(document, wanted))

    every_row = None if front_end.every_row is None else functools.cache(partial(front_end.every_row, document))
    gains = front_end.gains(document, _reproducible)
    again = partial(built_in, None, document, terms, method, profile, real, start=start)
    if stored is not None:
        again = stored.again
    from eomgen.pipeline.model import Model  # noqa: PLC0415  # while compilers run, if there is no library

    return Model(
        described,
        library,
        stepper,
        front_end.start(document),
        built,
        gains,
        every_row,
        partial(opened, document),
        again,
        in_lanes,
        in_complex,
        functools.cache(branches),
        partial(record_of_document, document, front_end),
    )


def method_of(scene: Scene, method: str | None) -> str:
    """Return the name of a method, or of the scene's. Raises UsageError or DescriptionError if there is none."""
    return _method_name(SCENES.describe(scene), method)


def terms_of_step(scene: Scene, method: str) -> tuple[str, ...]:
    """Return the terms that a step of a method calls."""
    from eomgen.integrators.families.register import terms_of  # noqa: PLC0415

    constrained = bool(scene.constraints) or scene.coordinates == "absolute"
    return terms_of(method, constrained, bool(scene.states))


def built_for_run(
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
    simulation = described.simulation
    if steps is not None:
        from eomgen.integrators.families.register import method_named  # noqa: PLC0415

        steps = None if method_named(_method_name(described, method)).chooses_steps else steps
    begun = start or simulation.start
    return built_in(None, document, None, method, profile, simulation.real, start=begun, steps=steps)


def build_for_rest(scene: Described, profile: str = STANDARD_PROFILE, *, points: int = 1) -> Model:
    """Return the compiled model of a scene with the functions that linear models about rest call, without a stepper;
    other functions are compiled at first use.

    Parameters
    ----------
    profile : as of ``build``
    points : number of linear models, each with some fifty evaluations, which may be made on the tape engine as the
        steps of ``built_for_run``
    """
    stored = record_of(scene)
    return built_in(None, stored.lean if stored else scene, None, None, profile, start=REST, steps=50.0 * points)


def _selected(terms: Sequence[str] | None, start: str = "") -> Selection:
    return Selection(None if terms is None else tuple(terms), start)


def _reproducible(document: Document, terms: Sequence[str]) -> Model:
    """Return a model from which values of parameters or states are found: the same bits everywhere."""
    return build(document, terms, profile="reproducible", real="double")


def as_document(described: Described) -> tuple[Document, FrontEnd]:
    """Return a scene or another front end's document unchanged, or a scene read from a path or made of nested data."""
    if isinstance(described, StoredScene):
        return described, SCENES
    if not isinstance(described, str | os.PathLike | Mapping):
        if is_scene(described):
            return described, SCENES
        if isinstance(own := getattr(described, "front_end", None), FrontEnd):
            return described, own
        for row in (loaded(entry, FrontEnd) for entry in extensions("eomgen.front_ends")):
            if isinstance(described, row.document):
                return described, row
    return load_scene(described), SCENES  # for anything else, load names the expected kinds


def _given_scene(scene: object, coordinates: Literal["joint", "absolute"] | None) -> Scene:
    """Return a scene unchanged, or made of nested data; raise UsageError for impossible sources or targets."""
    from eomgen.scene.load import from_data, named_method  # noqa: PLC0415  # a stored scene needs no reader
    from eomgen.scene.scene import Scene  # noqa: PLC0415

    if isinstance(scene, Scene):
        if coordinates not in (None, scene.coordinates):
            fault = f"this Scene has {scene.coordinates} coordinates, and they are chosen where it is read [E0551]"
            raise UsageError(Problem("coordinates", fault, "the path or the mapping that it was read from"))
        return scene
    if isinstance(scene, Mapping):
        try:
            result = from_data(scene, coordinates=coordinates)
        except DescriptionError as error:
            raise _with_method_problems(error, lambda: (named_method(scene), "scene")) from None
        _check_method(result, "scene")
        return result
    for row in file_kinds():
        if isinstance(scene, row.front_end.document):
            name = getattr(scene, "name", row.kind)
            raise UsageError(f"{name} is {row.noun}, and this is for mechanical scenes [E0552]", row.remedy)
    kind = type(scene).__name__
    if kind == "SceneBuilder":
        raise UsageError("a SceneBuilder collects a scene, which its method build returns [E0553]", "builder.build()")
    hint = "eomgen.load, SceneBuilder(...).build(), or a path"
    raise UsageError(f"a scene, a path or a mapping like a scene file is needed, not {kind} [E0554]", hint)


def _check_real(real: str | None) -> None:
    """Raise UsageError for an unknown number type."""
    if real not in (None, "double", "float"):
        raise UsageError(f"a model cannot be built with real = {real!r} [E0555]", "double or float")


def checked_terms(terms: Iterable[str] | None) -> tuple[str, ...] | None:
    """Return the terms that a caller names. Raises UsageError for unknown terms."""
    if terms is None:
        return None
    names = names_of("terms", "terms", terms, "mass")
    if unknown := [name for name in names if not (isinstance(name, str) and name in TERMS)]:
        every = ", ".join(shown(name) for name in unknown)
        hint = " and ".join(dict.fromkeys(nearest_term(str(name)) for name in unknown[:3]))
        raise UsageError(f"no term is called {every} [E0497]", hint)
    return names


def _method_name(described: Description, method: str | None) -> str:
    """Return the requested method, or the described one; the default one if runs choose.

    Raises UsageError or DescriptionError for an unknown name of a method.
    """
    from eomgen.integrators.families.register import AUTO, STANDARD, canonical_name  # noqa: PLC0415

    if (described.simulation.method if method is None else method) == AUTO:
        return STANDARD
    if method is not None:
        return canonical_name(method)
    return _own_method(described.simulation, described.places.get("simulation.method", described.name))


def _check_method(scene: Scene, place: str = "") -> None:
    """Raise DescriptionError if a scene names an unknown method; ``place`` names a scene without a file."""
    from eomgen.system.description import Simulation  # noqa: PLC0415

    if scene.simulation.method == Simulation.method:
        return
    from eomgen.integrators.families.register import AUTO  # noqa: PLC0415  # few scenes choose a method

    if scene.simulation.method != AUTO:
        _own_method(scene.simulation, scene.source.get("simulation.method", place or scene.name))


def _with_method_problems(error: DescriptionError, method: Callable[[], tuple[object, str]]) -> DescriptionError:
    """Return the error of a description, with one more problem if the description's method is unknown.

    Parameters
    ----------
    method : returns the description's method and the method's place in the file
    """
    from eomgen.system.description import Simulation  # noqa: PLC0415

    try:
        name, place = method()
    except EomgenError:  # the file cannot be read, which the error reports
        return error
    if not isinstance(name, str) or name == "auto" or any("(simulation.method)" in p.where for p in error.problems):
        return error
    try:
        _own_method(Simulation(method=name), place)
    except DescriptionError as unknown:
        return DescriptionError([*error.problems, *unknown.problems])
    return error


def _own_method(simulation: Simulation, place: str) -> str:
    """Return the name of the method that a scene asks for. Raises DescriptionError if there is none of this name."""
    from eomgen.integrators.families.register import canonical_name  # noqa: PLC0415

    try:
        return canonical_name(simulation.method, simulation.tolerance)
    except UsageError as error:
        problems = [Problem(f"{place} (simulation.method)", p.what, p.hint) for p in error.problems]
        raise DescriptionError(problems) from None


def _method(described: Description, method: str | None, *, for_runs: bool) -> Method:
    """Return a method with the described parameters, if the method has such parameters.

    Raises DescriptionError if the described method cannot take these parameters, UsageError if another method cannot
    run with its own defaults.

    Parameters
    ----------
    for_runs : whether runs give the stepper its parameters, so that the parameters of the made stepper do not matter
    """
    from eomgen.integrators.families.register import method_compiled, method_named, method_parameters  # noqa: PLC0415

    name = _method_name(described, method)
    try:
        return method_named(name, **method_parameters(name, {}, vars(described.simulation)))
    except UsageError as error:
        if name != _method_name(described, None):
            return method_compiled(name) if for_runs else method_named(name)
        problems = []
        for p in error.problems:
            key = p.where.replace("method.", "simulation.")
            key = key if key in described.places else "simulation.method"
            problems.append(Problem(f"{described.places.get(key, described.name)} ({key})", p.what, p.hint))
        raise DescriptionError(problems) from None


def _program(
    document: Document,
    front_end: FrontEnd,
    selection: Selection,
    method: str | None,
    target: Target,
    *,
    for_runs: bool = False,
    parameters: Mapping[str, float | str] | None = None,
    begin: BeginLibrary | None = None,
) -> tuple[Program, str]:
    """Return the Program, and the reason if the Program has no stepper.

    Parameters
    ----------
    for_runs : as of ``_method``
    parameters : as of ``generate``
    begin : called when all data of the stepper are known and before functions are scheduled
    """
    described = front_end.describe(document)
    chosen = _method(described, method, for_runs=for_runs)
    prepared = front_end.prepared(document, _reproducible)
    if parameters:
        from eomgen.pipeline.generated_defaults import with_parameters  # noqa: PLC0415

        prepared = with_parameters(prepared, described, parameters)
    with_settings = _method_name(described, method) == _method_name(described, None)

    def derived(part: Document, sample: Sample | None = None) -> tuple[Program, str]:
        settings = {"with_settings": with_settings, "for_runs": for_runs}
        early = None if sample is not None else begin
        return _derived_program(part, described, selection, chosen, target, sample, begin=early, **settings)

    return front_end.program(prepared, derived) or derived(prepared)


def _derived_program(
    document: Document,
    described: Description,
    selection: Selection,
    chosen: Method,
    target: Target,
    sample: Sample | None,
    *,
    with_settings: bool,
    for_runs: bool = False,
    begin: BeginLibrary | None = None,
) -> tuple[Program, str]:
    """Return the Program of a document, derived, and the reason if the Program has no stepper.

    Parameters
    ----------
    sample : of the longer document that is meant, if any
    with_settings : whether the settings described are of this method
    for_runs : as of ``_method``; then functions that no run calls are marked, if all functions are selected
    begin : as of ``_program``
    """
    from eomgen.codegen.convert import to_program  # noqa: PLC0415
    from eomgen.integrators.stepper_data import method_data  # noqa: PLC0415

    if selection.start == REST:
        return _program_of_rest(document, described, target)
    system, called = _called_functions(document, selection, chosen)
    if target.steppers:
        system = chosen.prepared(system)
    if sample is not None:
        system = replace(system, sample=sample)
    functions = selection.functions(list(system.functions), called, implicit=chosen.implicit)
    if not target.steppers:
        return to_program(system, None, functions, names=target.names), f"{target.language} has functions only"
    try:
        data = method_data(chosen, system, described.simulation.step)
        if with_settings:
            data = _with_settings(data, described)
        if begin is not None and (known := begin(system, data, functions, target.names)) is not None:
            return known, ""
        program = to_program(system, data, functions, names=target.names)
        if for_runs and selection.whole:
            from eomgen.pipeline.libraries import functions_for_later, functions_of_runs  # noqa: PLC0415

            early = functions_of_runs(system, chosen, called, described.simulation.start)
            program = replace(program, later=functions_for_later(program, early))
        return program, ""
    except ModelError as error:
        return to_program(system, None, functions, names=target.names), "; ".join(
            dict.fromkeys(problem.what for problem in error.problems)
        )


def _called_functions(document: Document, selection: Selection, chosen: Method) -> tuple[System, Set[str]]:
    """Return the system with the terms of a selection, or with all that a method calls, and the names that it calls."""
    system = derive(document, selection.terms)
    steps = chosen.calls(system)
    called = steps.union(chosen.terms(bool(system.multipliers), bool(system.states), "mass" in system.functions))
    absent = called - set(system.functions)
    lacking = [
        name
        for name in TERMS
        if name in absent and (TERMS[name].on_request or (TERMS[name].quadratic and name in steps))
    ]
    if lacking and selection.terms is None:
        system = derive(document, [*(name for name in system.functions if name in TERMS), *lacking])
    return system, called


def _program_of_rest(document: Document, described: Description, target: Target) -> tuple[Program, str]:
    """Return the Program of the functions that linear models about rest call, and the reason that there is no
    stepper."""
    from eomgen.codegen.convert import to_program  # noqa: PLC0415

    system = derive(document)
    holding = {
        "constraints": system.multipliers,
        "states": system.states,
        "outputs": system.outputs,
        "samples": system.sampled,
        "absolute": described.joints,
    }
    facts = {name for name, parts in holding.items() if parts} | (set() if system.multipliers else {"unconstrained"})
    disturbed = bool(system.inputs or described.disturbances)
    terms = linear_terms(system.functions, disturbed=disturbed, states=bool(system.states), moving=False)
    if any(name not in system.functions and TERMS[name].exists_with(facts) for name in terms):
        system = derive(document, terms)
    functions = [name for name in system.functions if name in terms or name not in TERMS or TERMS[name].of_events]
    return to_program(system, None, functions, names=target.names), "the library is of linear models about rest"


def _with_settings(data: dict[str, Any], described: Description) -> dict[str, Any]:
    """Return the data of the described method with the described settings as defaults. Raises DescriptionError."""
    from eomgen.integrators.stepper_layout import with_settings  # noqa: PLC0415

    try:
        return with_settings(data, described.simulation.settings)
    except UsageError as error:
        where = f"{described.places.get('simulation.settings', described.name)} (simulation.settings)"
        raise DescriptionError([Problem(where, p.what, p.hint) for p in error.problems]) from None


def _is_faster_on_tape(functions: Sequence[Mapping[str, Any]], loops: int, steps: float) -> bool:
    """Return whether a run of ``steps`` steps would end on the tape engine before the compilers end; ``functions`` and
    ``loops`` as for ``compiler_seconds``."""
    from eomgen.toolchain.compiler import compilers_at_once  # noqa: PLC0415
    from eomgen.toolchain.profiles import compiler_seconds, run_seconds_on_tape  # noqa: PLC0415

    compiled, on_tape = compiler_seconds(functions, compilers_at_once(), loops), run_seconds_on_tape(functions, steps)
    _LOG.info("estimated %.2g s of compilers, and %.2g s of the run on the tape engine", compiled, on_tape)
    return on_tape < compiled


def _library(
    document: Document,
    front_end: FrontEnd,
    selection: Selection,
    method: str,
    builder: Builder,
    steps: float | None = None,
) -> Library:
    """Return the library with a stepper, from the cache if the library is there.

    Parameters
    ----------
    steps : as of ``built_for_run``
    """
    content = library_content(document, front_end, selection, method)
    marks = {"built_method": method, "selection": vars(selection), "fingerprint": fingerprint(document, front_end)}

    @functools.cache
    def ready() -> EarlyTexts:
        from eomgen.integrators.families.register import stamp_of  # noqa: PLC0415
        from eomgen.pipeline.libraries import EarlyTexts  # noqa: PLC0415  # a library of the cache needs no texts

        return EarlyTexts(stamp_of(method))

    @functools.cache
    def program() -> tuple[Program, str]:
        from eomgen.codegen.targets.c.interface import INTERFACE_CDEF, interface_header  # noqa: PLC0415
        from eomgen.codegen.targets.register import C  # noqa: PLC0415
        from eomgen.pipeline.libraries import begin_library  # noqa: PLC0415

        builder.begin_wrapper(INTERFACE_CDEF, interface_header())
        with without_garbage_collection():
            begin = partial(begin_library, builder, ready())
            return _program(document, front_end, selection, method, C, for_runs=True, begin=begin)

    def made(builder: Builder, running: RunningCompilers | None = None) -> Library:
        """Return the library from the cache, else derived and compiled."""
        cached = builder.find(content)
        if cached is not None:
            return cached
        from eomgen.pipeline.libraries import whole_library  # noqa: PLC0415

        with builder.claim(content):
            return builder.find(content) or whole_library(*program(), builder, content, marks, running, ready())

    if steps is not None and not builder.profile.on_tape:
        cached = builder.find(content)
        if cached is not None:
            return cached
        on_tape = builder.varied(profile="instant")
        there = on_tape.find(content)
        if there is None:
            from eomgen.codegen.metadata import loop_operations  # noqa: PLC0415  # a library of the cache has a layout

            made_of = program()[0]
            functions, loops = list(map(vars, made_of.functions)), loop_operations(made_of)
        else:
            functions, loops = there.layout["functions"], there.layout["loop_operations"]
        if ready().known is None and _is_faster_on_tape(functions, loops, steps):
            return made(on_tape)
    if not builder.profile.on_tape:
        if not selection.whole or not builder.profile.split or builder.real != "double":
            return made(builder)
        cached = builder.find(content)
        if cached is not None:
            return cached
        from eomgen.pipeline.libraries import library_in_two  # noqa: PLC0415

        return library_in_two(content, program, builder, marks, ready())
    from eomgen.toolchain.library import Successor  # noqa: PLC0415

    compiled = builder.varied(profile=builder.profile.successor)
    cached = compiled.find(content)
    if cached is not None:
        return cached
    library = made(builder)
    library.successor = Successor(partial(made, compiled))
    return library
