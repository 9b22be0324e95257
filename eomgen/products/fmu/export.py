"""``fmu``: a scene as a unit of the Functional Mock-up Interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import unwrap
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.csv_tables import csv_text
from eomgen.base.data import dataclass, replace
from eomgen.base.files import check_writable, make_folder, read_bytes, write_bytes
from eomgen.base.messages import nearest, shown
from eomgen.codegen.targets.c.naming import free_prefix
from eomgen.codegen.targets.register import C
from eomgen.errors import FileError, ModelError, Problem, UsageError
from eomgen.pipeline.documents import as_document, load_scene
from eomgen.pipeline.generation import exported_program
from eomgen.pipeline.methods import is_constrained, method_of, terms_of_step
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.fmu.archive import documents, packed, token_of
from eomgen.products.fmu.arrays import listed
from eomgen.products.fmu.binary import built, cross_built, machine_named, this_machine
from eomgen.products.fmu.dae import MANIFEST, dae_manifest
from eomgen.products.fmu.dependencies import PATTERNS
from eomgen.products.fmu.derivatives import derivative_data
from eomgen.products.fmu.interface import NO_TOKEN, About, Interface, Options, interface_of
from eomgen.products.fmu.model_description import build_description, model_description
from eomgen.products.fmu.sources import compiled_sources, source_files, wrapper_name
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.pipeline.documents import Described
    from eomgen.scene.scene import Scene
    from eomgen.system.description import Description

#: Kinds of FMUs, by the names of the option.
TYPES: Mapping[str, str] = {"me": "model exchange", "cs": "co-simulation"}


@checked_call('eomgen.fmu("scene.toml", "model.fmu")', path="file", out="file", kind="types")
def fmu(
    scene: Described,
    file: str | Path | None = None,
    *,
    version: int | str = 3,
    types: Sequence[str] | str = ("me", "cs"),
    method: str | None = None,
    inputs: Sequence[str] = (),
    parameters: Mapping[str, float | str] | None = None,
    binary: bool = True,
    machines: Sequence[str] = (),
    reference: bool | None = None,
    profile: str = "reproducible",
    dae: bool = False,
    arrays: bool = False,
    minimal: bool = False,
    initial: Mapping[str, Any] | None = None,
    author: str = "",
    model_version: str = "",
    copyright: str = "",
    license: str = "",
    license_file: str | Path | None = None,
    description: str = "",
) -> Path:
    """Write a scene as an FMU: model description, sources, this machine's library, documentation, reference results.

    Co-simulation steps with the scene's own method, events and sampled controllers included, to the bits of
    ``simulate`` with the profile ``reproducible``. In model exchange the importer integrates q, v and internal states.

    Parameters
    ----------
    scene : Scene, path, or mapping
        As in ``build``.
    file : path
        NAME.fmu in the present folder by default. An existing file is replaced, and a missing folder is made.
    version : int
        Of FMI, 2 or 3; 2.0 and 3.0 as numbers or texts are the same.
    types : sequence of str
        ``me`` (model exchange) and ``cs`` (co-simulation), or one of both, in any case.
    method : str
        Method of co-simulation; the scene's by default.
    inputs : sequence of str
        Inputs with a formula in the scene that importers may set; inputs without one always are inputs of the FMU.
    parameters : mapping
        Values of tunable parameters, as in ``generate``: the start values of the FMU.
    binary : bool
        Whether the archive has this machine's library, and not sources alone.
    machines : sequence of str
        Further machines whose libraries zig makes: x86_64-linux, aarch64-linux, x86_64-windows, x86_64-darwin,
        aarch64-darwin.
    reference : bool
        Whether the archive has the motion of ``simulate`` as a table, which needs a compiler; as ``binary`` by default.
    profile : str
        Of the library: ``reproducible`` (the bits of ``simulate`` with this profile), or as of ``build``.
    dae : bool
        Whether importers can take the model as a differential-algebraic system and solve for accelerations and
        multipliers: FMI-LS-DAE, draft 1.0.0-alpha.1.
    arrays : bool
        Whether vectors (outputs, quaternions, positions, velocities of a joint) are arrays of FMI 3.0.
    minimal : bool
        Whether independent coordinates and velocities take the place of q and v among the states of model exchange;
        the FMU then solves the constraints for all further positions and velocities, and has no directional
        derivatives. For scenes with constraints, without ``dae``, and ``types`` with ``me``.
    initial : mapping
        Initial values as of ``simulate``: the start values of the FMU, brought onto the constraints, which needs a
        compiler.
    author, model_version, copyright, license : str
        Of the model, for the model description. ``license`` is a name, such as MIT or proprietary.
    license_file : path
        Text of the licence of the model, for the documentation.
    description : str
        Of the model; the scene's by default.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    UsageError, DescriptionError, ModelError, ToolchainError, FileError
        ModelError for parts that an FMU cannot have, controllers and motions of the caller, for a method that does not
        run on the scene, and for ``minimal`` without constraints. UsageError also for laws in Python, and for options
        that exclude each other, as ``arrays`` with FMI 2.0. ToolchainError for a missing compiler, or zig with
        ``machines``.

    Examples
    --------
    >>> eomgen.fmu("examples/double_pendulum_on_shaking_base/scene.toml", "pendulum.fmu").name
    'pendulum.fmu'
    """
    options = {name: value for name, value in locals().items() if name not in ("scene", "file")}
    return written(file, partial(fmu_files, scene, **options))[0]


def written(file: str | Path | None, make: Callable[[], FmuFiles]) -> tuple[Path, FmuFiles]:
    """Write an archive, and return the path and the files in the archive.

    Parameters
    ----------
    file : None: NAME.fmu
    make : called once the file can be written, since models take longer
    """
    path = None if file is None else Path(file)
    if path is not None:
        make_folder(path.parent)
        check_writable(path)
    made = make()
    if path is None:
        path = Path(f"{made.interface.name}.fmu")
        check_writable(path)
    write_bytes(path, packed(made.files))
    return path, made


@dataclass(frozen=True)
class FmuFiles:
    """An FMU before packing: the interface, and files by path in the archive."""

    interface: Interface
    files: Mapping[str, str | bytes]


def fmu_files(scene: Described, **options_of_fmu: Any) -> FmuFiles:
    """Return the files of an FMU, not yet packed; options with their defaults, and errors, are as in ``fmu``."""
    asked = SimpleNamespace(**{**unwrap(fmu).__kwdefaults__, **options_of_fmu})
    options = _checked(asked)
    version = options.version
    others = [machine_named(name, version) for name in asked.machines]
    machine = this_machine(version) if asked.binary else None
    document = load_scene(scene)
    described = as_document(document)[1].describe(document)
    _check_exported(document, described, options)
    program, refusal = _program(document, asked.method, asked.parameters, options, asked.initial)
    if not program.method:
        name = method_of(document, asked.method)
        raise ModelError(f"{name} cannot run on this scene: {refusal} [E0860]", "another method, by --method")
    if program.method.get("samples", {}).get("from_caller"):
        fault = "functions of the caller give samples of a controller, and an FMU has no caller's functions [E0861]"
        raise ModelError(Problem(program.prefix, fault, 'source = "law.c", with the function in C'))
    if options.minimal:
        _check_minimal(program)
    interface = interface_of(program, described, options)
    derivatives = None if options.minimal else derivative_data(program, interface)
    motion: dict[str, str] = {}
    doubts: tuple[str, ...] = ()
    if asked.binary if asked.reference is None else asked.reference:
        motion, doubts = _reference(document, interface, asked.method, asked.parameters, asked.initial)
    interface = replace(interface, provides_derivatives=derivatives is not None, doubts=doubts)
    simulation = described.simulation
    texts = source_files(interface, derivatives)
    listed = compiled_sources(interface, texts)
    token = token_of({**texts, "": model_description(interface, simulation, listed)})
    wrapper = wrapper_name(interface)
    texts[wrapper] = texts[wrapper].replace(NO_TOKEN, token)
    interface = replace(interface, token=token)
    files: dict[str, str | bytes] = {f"sources/{name}": text for name, text in texts.items()}
    files["modelDescription.xml"] = model_description(interface, simulation, listed)
    if options.dae:
        files[MANIFEST] = dae_manifest(interface)
    if version == 3:
        files["sources/buildDescription.xml"] = build_description(interface, listed)
    files |= documents(
        interface,
        step=simulation.step,
        types=[TYPES[name] for name in options.types],
        sources=listed,
        fixed=[item for item in described.parameters if not item.tunable],
    )
    if machine is not None:
        files[machine.library_path(version, interface.identifier)] = built(interface, texts, asked.profile)
    for target in others:
        path = target.library_path(version, interface.identifier)
        files.setdefault(path, cross_built(interface, texts, target))
    files |= motion
    return FmuFiles(interface, files)


def _licence_text(file: str | Path | None) -> str:
    """Return the text of a licence. Raises FileError."""
    if file is None:
        return ""
    try:
        return read_bytes(Path(file), 1_000_000).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(Problem(shown(str(file)), "the licence is not a text in UTF-8 [E0864]", "plain text")) from None


def _checked(asked: SimpleNamespace) -> Options:
    """Return the options of an FMU from the arguments of ``fmu``. Raises UsageError for faults."""
    told = asked.author, asked.model_version, asked.copyright, asked.license
    about = About(*told, _licence_text(asked.license_file), asked.description)
    version, types, dae, arrays, minimal = asked.version, asked.types, asked.dae, asked.arrays, asked.minimal
    number = {"2": 2, "2.0": 2, "3": 3, "3.0": 3}.get(str(version))
    if number is None:
        raise UsageError(Problem("version", f"there is no version {shown(str(version))} of FMI here [E0866]", "2 or 3"))
    requested_types = types.split(",") if isinstance(types, str) else types
    names = [str(name).strip().lower() for name in requested_types if str(name).strip()]
    for name in names:
        if name not in TYPES:
            raise UsageError(Problem("types", f"there is no type {shown(name)} [E0867]", nearest(name, TYPES)))
    if not names:
        fault = "an FMU without model exchange and co-simulation has no use [E0868]"
        raise UsageError(Problem("types", fault, "me, cs"))
    if dae and (number != 3 or "me" not in names):
        fault = "differential-algebraic systems are a layer over model exchange of FMI 3.0 [E0869]"
        raise UsageError(Problem("dae", fault, "version 3 with me"))
    if arrays and number != 3:
        raise UsageError(Problem("arrays", "FMI 2.0 has scalars alone [E0871]", "version 3"))
    if minimal and "me" not in names:
        fault = "minimal coordinates are states of model exchange [E0872]"
        raise UsageError(Problem("minimal", fault, "types with me"))
    if minimal and dae:
        fault = "a differential-algebraic system has all coordinates as states [E0870]"
        raise UsageError(Problem("minimal", fault, "dae or minimal alone"))
    chosen = tuple(name for name in TYPES if name in names)
    return Options(number, chosen, tuple(asked.inputs), dae, arrays, about, minimal)


def _check_exported(scene: Scene, described: Description, options: Options) -> None:
    """Raise ModelError for parts that an FMU cannot have, UsageError for inputs that are none."""
    known = [item.name for item in described.inputs]
    for name in options.inputs:
        if name not in known:
            hint = nearest(name, known) if known else "no --input, since the scene has no inputs"
            raise UsageError(Problem("inputs", f"the scene has no input {shown(name)} [E0873]", hint))
    if described.motions:
        names = ", ".join(motion.name for motion in described.motions)
        fault = f"the caller moves {names} between steps, and FMI has no such motion [E0874]"
        raise ModelError(Problem(scene.name, fault, "a drive with a law of time, or a joint that an input drives"))


def _check_minimal(program: Program) -> None:
    """Raise ModelError if q and v are minimal already, without constraints, or constraints leave no freedom."""
    freedoms = program.sizes["v"] - program.sizes["lam"]
    if not program.sizes["lam"]:
        fault = "coordinates of a scene without constraints are minimal already [E0875]"
        raise ModelError(Problem(program.prefix, fault, "no option minimal"))
    if freedoms < 1:
        fault = "the constraints leave no freedom, so no states are left [E0876]"
        raise ModelError(Problem(program.prefix, fault, "no option minimal"))


def _program(
    scene: Scene,
    method: str | None,
    parameters: Mapping[str, float | str] | None,
    options: Options,
    initial: Mapping[str, Any] | None,
) -> tuple[Program, str]:
    """Return the Program of an FMU under a legal name, and the reason if the method's stepper is left out, else empty
    text. ``initial`` values replace the start of the scene."""
    if initial:
        scene = replace(scene, simulation=replace(scene.simulation, start="initial"))
    identifier = free_prefix(scene.name)
    document, front_end = as_document(scene if identifier == scene.name else replace(scene, name=identifier))
    name = method_of(scene, method)
    called = terms_of_step(scene, name)
    wanted = [*PURPOSES["run"], *PURPOSES["accelerations"], "inverse_dynamics", *called, *PATTERNS]
    wanted += ["inverse_dynamics_derivatives"] if options.dae and not is_constrained(scene) else []
    wanted = list(dict.fromkeys(wanted))
    program, refusal = exported_program(document, front_end, C, wanted, method, parameters=parameters)
    if initial and program.method:
        model = build_for_run(scene, method, None, "reproducible")
        run = model.start(initial=initial, parameters=parameters)
        program = _started(program, run.q, run.v, run.z)
    return program, refusal


def _started(program: Program, q: Array, v: Array, z: Array) -> Program:
    """Return a Program with the initial state q (nq,), v (nv,), z (nz,), also in the start values of coordinates."""
    coordinates = (replace(item, value=value) for item, value in zip(program.coordinates, q.tolist(), strict=True))
    velocities = (replace(item, value=value) for item, value in zip(program.velocities, v.tolist(), strict=True))
    return replace(
        program,
        start="The run starts at initial values that were given when the FMU was written.",
        initial_q=tuple(q.tolist()),
        initial_v=tuple(v.tolist()),
        initial_z=tuple(z.tolist()),
        coordinates=tuple(coordinates),
        velocities=tuple(velocities),
    )


def _reference(
    scene: Scene,
    interface: Interface,
    method: str | None,
    parameters: Mapping[str, float | str] | None,
    initial: Mapping[str, Any] | None,
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the motion by ``simulate``, states and outputs, as a file of reference results by path, and findings as
    texts. The findings are about the run and shared by runs with other steps."""
    model = build_for_run(scene, method, None, "reproducible")
    steps = scene.simulation.duration / scene.simulation.step
    every = max(1, round(steps / 500))  # a table of some hundred rows
    run = model.simulate(parameters=parameters, initial=initial, record_every=every, error_estimate=False)
    columns = {"time": run.t}
    columns |= {item.name: run.q[:, item.index] for item in interface.of("q")}
    columns |= {item.name: run.v[:, item.index] for item in interface.of("v")}
    columns |= {item.name: run.z[:, item.index] for item in (*interface.of("z"), *interface.of("sampled"))}
    values = [np.reshape(value, (len(run.t), -1)) for value in run.outputs.values()]
    if values:
        table = np.concatenate(values, axis=1)
        columns |= {item.name: table[:, item.index] for item in interface.of("output")}
    labels = {name: label for whole in listed(interface) for name, label in whole.labels.items()}
    columns = {labels.get(name, name): column for name, column in columns.items()}
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    doubts = tuple(map(str, run.model.alike() if run.model else ()))
    folder = "documentation" if interface.version == 2 else "extra/org.fmi-standard.fmi-ls-ref"
    return {f"{folder}/{interface.identifier}_reference.csv": csv_text([tuple(columns), *rows])}, doubts
