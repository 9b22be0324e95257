"""Write a folder of generated files completely or not at all; only files that eomgen generated are overwritten."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

from eomgen.base.files import temporary_file
from eomgen.codegen.program import Program
from eomgen.errors import FileError

MANIFEST = "manifest.json"


def manifest(program: Program, files: Mapping[str, str], **more: object) -> str:
    """Return the manifest of a folder: model, files, names and units of parameters, inputs, states and outputs in
    order, and inputs and outputs of the functions.

    Parameters
    ----------
    files : mapping
        Of the folder, without the manifest.
    more
        Further entries of a target.
    """
    data = {
        "generator": "eomgen",
        "version": program.version,
        "model": program.prefix,
        "files": sorted([*files, MANIFEST]),
        "sizes": dict(program.sizes),
        "quantities": {
            block: [dataclasses.asdict(quantity) for quantity in quantities]
            for block, quantities in (
                ("parameters", program.parameters),
                ("inputs", program.inputs),
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


def write_folder(files: Mapping[str, str], folder: Path | str) -> Path:
    """Write files to a folder, each under a temporary name first, and return the folder.

    Files of an earlier run that are named in the manifest and no longer exist are removed.

    Raises
    ------
    FileError
        The folder holds something that eomgen did not write, or cannot be written.
    """
    target = Path(folder)
    temporary: Path | None = None
    try:
        old = _earlier_files(target)
        target.mkdir(parents=True, exist_ok=True)
        # first, so that a broken folder is ours
        for name, text in sorted(files.items(), key=lambda item: item[0] != MANIFEST):
            with temporary_file(target / name) as stream:
                temporary = Path(stream.name)
                stream.write(text.encode())
            temporary.replace(target / name)
        for name in old - set(files):
            (target / name).unlink(missing_ok=True)
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise FileError(f"cannot write {target}: {error.strerror or error}", "another folder") from error
    return target


def _earlier_files(target: Path) -> set[str]:
    """Return the files that an earlier run left in a folder. Raises FileError for a folder of someone else's."""
    if not target.exists():
        return set()
    if not target.is_dir():
        raise FileError(f"{target} is a file, not a folder", "another folder")
    if not any(target.iterdir()):
        return set()
    try:
        manifest = json.loads((target / MANIFEST).read_text(encoding="utf-8"))
        if manifest["generator"] != "eomgen":
            raise KeyError
        return {Path(str(name)).name for name in manifest["files"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(
            f"{target} is not empty and was not written by eomgen (it has no {MANIFEST} of eomgen's); nothing was"
            " overwritten",
            "a new or empty folder",
        ) from error
