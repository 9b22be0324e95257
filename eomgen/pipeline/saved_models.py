"""Models from files of ``model.save``, without a compiler."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.files import read_arrays
from eomgen.compiled.saving import OF_PYTHON, check_machine, name_of
from eomgen.errors import FileError, Problem
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.pipeline import build_model
from eomgen.pipeline.readings import NoRecordError, from_record
from eomgen.pipeline.requests import ModelRequest
from eomgen.system.terms import Selection
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.compiler import library_suffix
from eomgen.toolchain.library import Library

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

_NOUN, _HINT = "compiled model", "a file of model.save"


@checked_call("the path of a file of model.save")
def load_model(path: str | os.PathLike[str]) -> Model:
    """Return the model that ``model.save`` wrote to a file; no compiler is needed.

    Terms and methods that the file lacks are compiled when a call asks for them, if there is a compiler. The libraries
    are copied to the cache. The file holds machine code, which is run: open files from trusted people only. Warns as
    ``build``.

    Parameters
    ----------
    path : path
        Of the file.

    Returns
    -------
    Model
        The model with the libraries of the file.

    Raises
    ------
    FileError
        The file cannot be read, is damaged, or was not written by ``model.save``; the cache cannot be written.
    ToolchainError
        The model was compiled for another machine, or by another version of eomgen; names the differences.

    Examples
    --------
    >>> file = eomgen.build("examples/four_bar/scene.toml").save("four_bar.eomgen")
    >>> eomgen.load_model(file).nq
    3
    """
    arrays, metadata = read_arrays(Path(path), _NOUN, _HINT)
    try:
        profile, real = str(metadata["profile"]), str(metadata["real"])
        check_machine(path, metadata, profile)
        record = from_record(metadata["record"])
        builder = Builder(profile=profile, real=real)
        mode = metadata["mode"] if metadata["made for"][OF_PYTHON] == library_suffix() else "abi"
        names = [(Selection.from_data(selection), str(method)) for selection, method in metadata["libraries"]]
        libraries = dict(zip(names, _libraries(arrays, builder, mode, len(names)), strict=True))
    except (KeyError, TypeError, ValueError, AttributeError, NoRecordError) as error:
        why = f"{error.args[0]} is missing" if isinstance(error, KeyError) else error
        fault = f"this is not a {_NOUN} written by eomgen: {why} [E0134]"
        raise FileError(Problem(str(path), fault, _HINT)) from None
    functions = names[0][0]
    asked = *as_document(record.lean), functions.terms, metadata["method"], profile, real, functions.start, None
    return build_model(ModelRequest(*asked, libraries, partial(load_model, path)))


def _libraries(arrays: Mapping[str, Array], builder: Builder, mode: str, count: int) -> Iterator[Library]:
    """Yield the first ``count`` libraries of a file of a model, each kept in the cache of the builder and loaded.
    ``arrays`` are the files of all libraries by name; ``mode`` is the mode of cffi."""
    for number in range(count):
        start = name_of(number, "")
        files = {name.removeprefix(start): data.tobytes() for name, data in arrays.items() if name.startswith(start)}
        yield builder.load_files(files, mode)
