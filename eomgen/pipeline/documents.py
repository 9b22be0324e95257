"""Documents of front ends, from all that describes equations: paths, nested data, Scenes, documents themselves."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

from eomgen.base.calls import checked_call
from eomgen.base.data import without_garbage_collection
from eomgen.base.extensions import extensions, load_row
from eomgen.base.messages import log_notes
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.pipeline.front_end import Document, FileKind, FrontEnd, file_kinds, is_scene, other_document
from eomgen.pipeline.readings import StoredScene, record_of, store, stored_scene
from eomgen.pipeline.scenes import SCENES

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene
    from eomgen.system.description import Simulation

    #: A scene, the path of a scene, nested data in the form of a scene file, or the document of another front end.
    Described: TypeAlias = Scene | str | os.PathLike[str] | Mapping[str, Any] | Document

#: Options of ``load`` as all other verbs read a file.
_DEFAULTS: Mapping[str, Any] = {"strict": False, "coordinates": None, "task_frames": ()}


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

    Data, or a ``.toml`` file, with ``kind = "hamiltonian"`` give a Hamiltonian system in place of a Scene. Notes of a
    scene, as on elements left out, go once to the logger ``eomgen.notes``, or to stderr if ``logging`` is not loaded.

    Parameters
    ----------
    path : path, mapping or Scene
        A mapping holds the data of a scene file; a Scene is returned unchanged.
    strict : bool
        Refuse elements that an importer would leave out with a note, by DescriptionError.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of the file's own (a URDF's are joint).
    task_frames : sequence of str
        Bodies and frames of the terms of frames (such as ``frame_jacobians``), in place of the file's own; by default
        the file's, all bodies and frames if the file names none, as a URDF.
    **options
        For URDF: ``root``, whether the root link is ``fixed`` to the base, the default, or ``free``; ``lock``, moving
        joints to be fixed at zero; ``limits``, to turn limits of position into compliant stops, as hard as the joints'
        largest efforts ask for; ``friction``, to take the dry friction of joints, regularised at 0.01 rad/s and 1 mm/s;
        ``actuated``, to give every moving joint of one coordinate an effort input of its own name; ``transmissions``,
        to make the efforts of actuators inputs, which transmissions carry to the joints; ``tunable``, links whose mass,
        centre of mass and inertia become tunable parameters.
        For MJCF: ``keyframe``, the start; ``mocap``, to move mocap bodies by motions from outside; ``limits`` and
        ``friction``.
        For SDF: ``weld``, links and frames that are fixed to the base at their places; ``packages``, folders of
        packages and models that the file names, each as ``NAME=FOLDER``; ``lock``, ``limits``, ``friction`` and
        ``actuated``.
        Other options are off or empty by default.

    Returns
    -------
    Scene
        The checked scene.

    Raises
    ------
    FileError
        The file cannot be read, or is larger than 10 MB.
    DescriptionError
        With all faults of the content.
    UsageError
        A kind of file that eomgen does not read; a missing file without an ending; an unknown option, or an option of
        another kind of file; ``task_frames``, or other coordinates, for a Scene.

    Examples
    --------
    >>> eomgen.load("examples/four_bar/scene.toml").name
    'four_bar'
    """
    all_options = {"strict": strict, "coordinates": coordinates, "task_frames": task_frames, **options}
    stored = stored_scene(path, all_options)
    if stored is None and (kind_and_document := other_document(path, all_options)) is not None:
        return cast("Scene", kind_and_document[1])
    with without_garbage_collection():
        scene = load_scene(path, **all_options) if stored is None else stored.scene
    log_notes(scene.name, scene.notes)
    return scene


def read(described: Described, **options: object) -> tuple[Any, FrontEnd, FileKind | None]:
    """Return the document of any description, the front end, and the kind of file, None for a mechanical scene.

    A path is taken from the cache of readings if no file has changed; the document is a StoredScene then.

    Parameters
    ----------
    options : of mechanical scenes, which other kinds of files refuse
    """
    with without_garbage_collection():
        stored = record_of(described) or stored_scene(described, _DEFAULTS)
        if stored is not None:
            return stored.lean, SCENES, None
        if (kind_and_document := other_document(described, options)) is not None:
            return kind_and_document[1], kind_and_document[0].front_end, kind_and_document[0]
        return *as_document(described), None


def as_document(described: Described) -> tuple[Document, FrontEnd]:
    """Return the document and the front end of a description. Scenes and documents of other front ends are returned
    unchanged; paths and nested data are read as a scene. Raises UsageError for anything else."""
    if isinstance(described, StoredScene):
        return described, SCENES
    if not isinstance(described, str | os.PathLike | Mapping):
        if is_scene(described):
            return described, SCENES
        if isinstance(front_end := getattr(described, "front_end", None), FrontEnd):
            return described, front_end
        for row in (load_row(entry, FrontEnd) for entry in extensions("eomgen.front_ends")):
            if isinstance(described, row.document):
                return described, row
    return load_scene(described), SCENES  # for anything else, load names the expected kinds


def load_scene(path: Described, **options: Any) -> Scene:
    """Return a mechanical scene from a path, nested data or a Scene; options are as in ``load``. Scenes of files are
    taken from the cache of readings, and else kept there. Raises UsageError and DescriptionError."""
    all_options = {**_DEFAULTS, **options}
    if (stored := stored_scene(path, all_options)) is not None:
        return stored.scene
    if isinstance(path, str | os.PathLike):
        from eomgen.base.files import digests_of_files  # noqa: PLC0415  # each stage of the road is imported when reached
        from eomgen.scene import load as reader  # noqa: PLC0415

        with digests_of_files() as files:
            scene = reader.load(Path(path), **all_options)
        store(path, all_options, scene, SCENES.describe(scene), files)
        return scene
    from eomgen.scene.sources.register import checked_options  # noqa: PLC0415

    checked_options(None, {name: value for name, value in options.items() if name not in _DEFAULTS})
    frames, coordinates = all_options["task_frames"], all_options["coordinates"]
    if not frames:
        return _given_scene(path, coordinates)
    if isinstance(path, Mapping):
        names = [frames] if isinstance(frames, str) else list(frames)
        return _given_scene({**path, "task_frames": names}, coordinates)
    fault = "the task frames of a Scene are chosen where it is read [E0543]"
    raise UsageError(Problem("task_frames", fault, "the path or the mapping that it was read from"))


def _given_scene(scene: object, coordinates: Literal["joint", "absolute"] | None) -> Scene:
    """Return a Scene unchanged, or the scene made of a mapping with the data of a scene file. ``coordinates`` replaces
    the entry of a mapping. Raises UsageError for anything else, or for a Scene with other coordinates."""
    from eomgen.scene.load import from_data  # noqa: PLC0415  # a stored scene needs no reader
    from eomgen.scene.scene import Scene  # noqa: PLC0415

    if isinstance(scene, Scene):
        if coordinates not in (None, scene.coordinates):
            fault = f"this Scene has {scene.coordinates} coordinates, and they are chosen where it is read [E0551]"
            raise UsageError(Problem("coordinates", fault, "the path or the mapping that it was read from"))
        return scene
    if isinstance(scene, Mapping):
        return from_data(scene, coordinates=coordinates)
    for row in file_kinds():
        if isinstance(scene, row.front_end.document):
            name = getattr(scene, "name", row.kind)
            raise UsageError(f"{name} is {row.noun}, and this is for mechanical scenes [E0552]", row.remedy)
    kind = type(scene).__name__
    if kind == "SceneBuilder":
        raise UsageError("a SceneBuilder collects a scene, which its method build returns [E0553]", "builder.build()")
    hint = "eomgen.load, SceneBuilder(...).build(), or a path"
    raise UsageError(f"a scene, a path or a mapping like a scene file is needed, not {kind} [E0554]", hint)


def described_method(simulation: Simulation, location: str) -> str:
    """Return the name of the method that a scene asks for. Raises DescriptionError if there is none of this name."""
    from eomgen.integrators.families.register import canonical_name  # noqa: PLC0415

    try:
        return canonical_name(simulation.method, simulation.tolerance)
    except UsageError as error:
        problems = [Problem(f"{location} (simulation.method)", p.what, p.hint) for p in error.problems]
        raise DescriptionError(problems) from None
