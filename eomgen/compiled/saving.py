"""Compiled models as files, for machines without a compiler: libraries with their steppers, scene and description, and
the machine of the libraries."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files import write_arrays
from eomgen.base.version import __version__, checkout_stamp
from eomgen.errors import ModelError, Problem, ToolchainError
from eomgen.toolchain.builder import library_files
from eomgen.toolchain.compiler import library_suffix, processor_digest
from eomgen.toolchain.profiles import profile as profile_named

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: The version of Python for which an extension module was made; other versions open it as a plain library.
OF_PYTHON = "extension modules"


def save(model: CompiledModel, path: str | os.PathLike[str], *, methods: Sequence[str] = ()) -> Path:
    """Write the compiled model to a file, from which ``eomgen.load_model`` makes the model without a compiler.

    The file holds machine code for this operating system, this architecture and this version of eomgen; with the
    profile ``fast`` for this kind of processor, so ``reproducible`` is for models that travel.

    Parameters
    ----------
    path : path
        Of the file; an existing file is replaced.
    methods : sequence of str
        Methods whose steppers are stored in addition to the model's own, compiled now if they have not been.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    UsageError, ModelError, ToolchainError, FileError
        ModelError for a model whose equations come from another distribution.

    Examples
    --------
    >>> model = eomgen.build("examples/four_bar/scene.toml")
    >>> model.save("four_bar.eomgen").name
    'four_bar.eomgen'
    """
    if model.record is None:
        fault, hint = "this model was made by hand [E0276]", "eomgen.build(scene), whose models can be saved"
        raise ModelError(Problem("save", fault, hint))
    record = model.record()
    model.finish_compilation()
    own_library = model.library
    libraries = [own_library, *(model.stepper(method) for method in methods)]
    arrays: dict[str, Array] = {}
    for number, library in enumerate(libraries):
        for name, data in library_files(library).items():
            arrays[name_of(number, name)] = np.frombuffer(data, np.uint8)
    metadata = {
        "made for": dict(machine(own_library.profile)),
        "profile": own_library.profile,
        "mode": own_library.mode,
        "real": own_library.real,
        "method": model.description.simulation.method,
        "libraries": [[library.layout["selection"], library.layout["built_method"]] for library in libraries],
        "record": record,
    }
    file = Path(path)
    write_arrays(file, arrays, metadata)
    return file


def name_of(number: int, name: str) -> str:
    """Return the name in the archive for a file of a library, which counts from 0."""
    return f"library {number}: {name}"


def machine(profile: str) -> Iterator[tuple[str, str]]:
    """Yield (name, value) of the facts about machine and versions that a model compiled with a profile depends on."""
    yield "version of eomgen", __version__
    yield "code of eomgen in a checkout", checkout_stamp()[:16]
    yield "operating system", platform.system()
    yield "architecture", platform.machine()
    yield "C library", platform.libc_ver()[0]
    yield OF_PYTHON, library_suffix()
    if profile_named(profile).native:
        yield f"processor, for which profile {profile} compiles", processor_digest()


def check_machine(path: str | os.PathLike[str], metadata: Mapping[str, Any], profile: str) -> None:
    """Raise ToolchainError if a model file was compiled on another machine or by another version of eomgen.
    ``metadata`` belong to the file at ``path``; the message lists all facts that differ."""
    there, here = metadata["made for"], dict(machine(profile))
    apart = [
        f"{name} {there.get(name) or 'none'}, here {value or 'none'}"
        for name, value in here.items()
        if name != OF_PYTHON and there.get(name) != value
    ]
    if apart:
        fault = f"this model was compiled for another machine or version: {'; '.join(apart)} [E0277]"
        hint = 'eomgen.build(scene, profile="reproducible").save(path) on a machine like this one'
        raise ToolchainError(Problem(str(path), fault, hint))
