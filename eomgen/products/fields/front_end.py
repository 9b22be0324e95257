"""The verbs for Hamiltonian systems: files with ``kind = "hamiltonian"``, from their text to compiled models."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.data import replace
from eomgen.base.files import open_file
from eomgen.errors import Problem, UsageError
from eomgen.pipeline.content import library_content
from eomgen.pipeline.front_end import FrontEnd, given_options
from eomgen.products.fields.documents.document import Hamiltonian
from eomgen.system.description import Description
from eomgen.system.terms import Selection

if TYPE_CHECKING:
    from eomgen.products.fields.documents.document import FieldSystem
    from eomgen.products.fields.hamiltonian.model import HamiltonianModel
    from eomgen.system.system import System

#: Keys above the tables of a Hamiltonian file; scenes have neither, so a misspelt kind is reported.
_KIND = re.compile(r"^\s*(kind|hamiltonian)\s*=", re.MULTILINE)
_TABLE = re.compile(r"^\s*\[", re.MULTILINE)
#: The mark of a file of fields: a table of the mesh.
_MESH = re.compile(r"^\s*(\[\s*mesh\s*\]|mesh\s*[.=])", re.MULTILINE)


def _describe(document: Hamiltonian) -> Description:
    return Description(document.name, document.description)


def _derive(document: Hamiltonian, terms: object = None) -> System:
    from eomgen.products.fields.hamiltonian.code import derive_hamiltonian  # noqa: PLC0415

    return derive_hamiltonian(document)


HAMILTONIANS = FrontEnd("hamiltonian", Hamiltonian, _describe, _derive)


def says_hamiltonian(path: str | os.PathLike[str]) -> bool:
    """Return True if a file declares a Hamiltonian system; an unreadable file does not."""
    text = _text(path)
    table = _TABLE.search(text)
    return _KIND.search(text[: table.start()] if table else text) is not None


def _text(path: str | os.PathLike[str]) -> str:
    """Return the text of a TOML file; empty if the file cannot be read."""
    file = Path(path)
    if file.suffix.lower() != ".toml":
        return ""
    try:
        with open_file(file.expanduser()) as stream:
            return stream.read().decode("utf-8", "replace")
    except (OSError, ValueError, RuntimeError):
        return ""


def field_system_of(path: str | os.PathLike[str]) -> FieldSystem | None:
    """Return the system of fields on a mesh that a file describes; None if the file describes anything else.

    Raises
    ------
    DescriptionError
        With all faults of the content.
    """
    if not says_hamiltonian(path) or not _MESH.search(_text(path)):
        return None
    from eomgen.products.fields.documents.field_reading import load_fields  # noqa: PLC0415  # most scenes are mechanical

    return load_fields(path)


def hamiltonian_of(described: object, options: Mapping[str, Any] | None = None) -> Hamiltonian | None:
    """Return the Hamiltonian system of an object: a Hamiltonian, nested data, or the path of a file; None for other
    documents. ``options`` are options of mechanical scenes, which may not be given.

    Raises
    ------
    DescriptionError
        With all faults of the content.
    UsageError
        For an option of mechanical scenes.
    """
    if isinstance(described, Hamiltonian):
        result = described
    elif isinstance(described, Mapping) and ("kind" in described or "hamiltonian" in described):
        from eomgen.products.fields.documents.reading import hamiltonian_from_data  # noqa: PLC0415  # most scenes are mechanical

        result = hamiltonian_from_data(described)
    elif isinstance(described, str | os.PathLike) and says_hamiltonian(described):
        from eomgen.products.fields.documents.reading import load_hamiltonian  # noqa: PLC0415

        result = load_hamiltonian(described)
    else:
        return None
    if result.method_place:
        from eomgen.products.fields.hamiltonian.methods import check_name, method_of_file  # noqa: PLC0415  # few files have one

        with method_of_file(result):
            check_name(result.simulation.method)
    if chosen := given_options(options or {}):
        fault = f"{', '.join(chosen)} belongs to mechanical scenes, and {result.name} is a Hamiltonian system [E0774]"
        raise UsageError(Problem(chosen[0], fault, "leave it out"))
    return result


def build_hamiltonian(document: Hamiltonian, method: str | None, profile: str) -> HamiltonianModel:
    """Return the compiled model of a system, from the cache if unchanged. ``method`` replaces the file's method for
    runs (None: no change); ``profile`` is the profile of compilation. Raises UsageError for the profile of the tape
    engine, and for a method that is unknown or does not fit the system; ToolchainError for an unknown profile.
    """
    from eomgen.products.fields.hamiltonian.methods import method_for  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.model import HamiltonianModel, built_library  # noqa: PLC0415
    from eomgen.toolchain.builder import Builder  # noqa: PLC0415

    builder = Builder(profile=profile)
    if builder.profile.on_tape:
        fault = f"the tape engine is for mechanical scenes, and {document.name} is a Hamiltonian system [E0775]"
        raise UsageError(Problem("profile", fault, "fast, reproducible or quick"))
    method_for(document, method)
    if method is not None:
        run = document.simulation.model_copy(update={"method": method})
        document = replace(document, simulation=run, method_place="")
    content = library_content(document, HAMILTONIANS, Selection(None, ""), "rk4")
    return HamiltonianModel(document, built_library(document, content, builder))


def generate_hamiltonian(document: Hamiltonian, folder: str | Path, method: str | None) -> list[Path]:
    """Write a system as a folder of C that stands alone, with a main program by the method, and return the files'
    paths.

    The paths are sorted by name. Without ``method`` the file's method counts, or the standard one. Files of an earlier
    run in the folder, by its manifest, are replaced, or removed if no longer needed.

    Raises
    ------
    UsageError
        An unknown ``method``, or a composition of drifts and kicks for an H that is not T(p) + V(q).
    DescriptionError
        The same fault in the method of the file.
    ModelError
        A term of H has no finite value.
    FileError
        The folder holds files that eomgen did not write, or cannot be written.
    """
    from eomgen.codegen.folder import MANIFEST, manifest, write_folder  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.code import folder_files, program_of  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.methods import method_for  # noqa: PLC0415

    program = program_of(document)
    files = folder_files(document, program, method_for(document, method))
    files[MANIFEST] = manifest(program, files)
    written = write_folder(files, folder)
    return [written / name for name in sorted(files)]
