"""The folder of generated files: its manifest, and writing, completely or not at all; only files that eomgen generated
are overwritten."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from eomgen.base.files import read_file, temporary_file
from eomgen.codegen.program import Program
from eomgen.errors import FileError
from eomgen.system.system import Quantity

MANIFEST = "manifest.json"
#: Of the manifest; a larger number when keys change their meaning or are left out, not when keys are added.
FORMAT = 1


def manifest(program: Program, files: Mapping[str, str], **more: object) -> str:
    """Return the manifest of a folder: model, files, the quantities in the arrays of the C, and inputs and outputs of
    the functions.

    Each quantity has name, name in the C, place of its first number in the array, size, default, unit, description,
    and the ends of its range, null for a side without an end.

    Parameters
    ----------
    files : mapping
        Of the folder, without the manifest.
    more
        Further entries of a target.
    """
    data = {
        "format": FORMAT,
        "generator": "eomgen",
        "version": program.version,
        "model": program.prefix,
        "files": sorted([*files, MANIFEST]),
        "sizes": dict(program.sizes),
        "factors": [dict(factor) for factor in program.factors],
        "quantities": {
            block: list(_quantities(quantities, program.bounds))
            for block, quantities in (
                ("parameters", program.parameters),
                ("inputs", program.inputs),
                ("coordinates", program.coordinates),
                ("velocities", program.velocities),
                ("states", program.states),
                ("outputs", program.outputs),
            )
        },
        "functions": {
            function.name: {
                "inputs": function.inputs,
                "outputs": [output.name for output in function.outputs],
                "counts": dict(function.counts),
            }
            for function in program.functions
        },
        "license": "MIT",
        **more,
    }
    return json.dumps(data, indent=2, sort_keys=True) + "\n"


def _quantities(
    quantities: Sequence[Quantity], bounds: Mapping[str, tuple[float | None, float | None]]
) -> Iterator[dict[str, Any]]:
    """Yield one mapping for each quantity of a block of the manifest, in the order of the array. A mapping has the
    fields of the quantity, ``first`` (index of the first number in the array) and ``lower``, ``upper`` from ``bounds``,
    None for a side without an end."""
    first = 0
    for quantity in quantities:
        lower, upper = bounds.get(quantity.name, (None, None))
        yield {**dataclasses.asdict(quantity), "first": first, "lower": lower, "upper": upper}
        first += quantity.size


def write_folder(files: Mapping[str, str], folder: Path | str) -> Path:
    """Write files to a folder, all under temporary names first, and return the folder.

    Files of an earlier run that are named in the manifest and no longer exist are removed. If a file cannot be written,
    the folder stays unchanged.

    Raises
    ------
    FileError
        The folder holds something that eomgen did not write, or cannot be written.
    """
    target = Path(folder)
    temporaries: list[tuple[Path, str]] = []
    made = False
    try:
        old = _earlier_files(target)
        made = not target.exists()
        target.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            with temporary_file(target / name) as stream:
                temporaries.append((Path(stream.name), name))
                stream.write(text.encode())
        for temporary, name in temporaries:
            temporary.replace(target / name)
        for name in old - set(files):
            (target / name).unlink(missing_ok=True)
    except BaseException as error:
        for temporary, _ in temporaries:
            temporary.unlink(missing_ok=True)
        if made:
            with contextlib.suppress(OSError):
                target.rmdir()
        if not isinstance(error, OSError):
            raise
        raise FileError(f"cannot write {target}: {error.strerror or error} [E0211]", "another folder") from error
    return target


def _earlier_files(target: Path) -> set[str]:
    """Return the names of the files that an earlier run of eomgen wrote into a folder, by the folder's manifest. The
    set is empty for a folder that does not exist or has only hidden files. Raises FileError if the path is a file, or
    if the folder has files but no manifest of eomgen."""
    if not target.exists():
        return set()
    if not target.is_dir():
        raise FileError(f"{target} is a file, not a folder [E0212]", "another folder")
    if all(path.name.startswith(".") for path in target.iterdir()):  # a killed process leaves temporary files
        return set()
    try:
        manifest = json.loads(read_file(target / MANIFEST))
        if manifest["generator"] != "eomgen":
            raise KeyError
        return {Path(str(name)).name for name in manifest["files"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(
            f"{target} is not empty and was not written by eomgen (it has no {MANIFEST} of eomgen's); nothing was"
            " overwritten [E0213]",
            "a new or empty folder",
        ) from error
