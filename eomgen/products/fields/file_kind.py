"""The row of files with ``kind = "hamiltonian"`` in the register of kinds of files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from eomgen.pipeline.front_end import FileKind
from eomgen.products.fields.documents.document import OF_HAMILTONIANS
from eomgen.products.fields.front_end import (
    HAMILTONIANS,
    build_hamiltonian,
    field_system_of,
    generate_hamiltonian,
    hamiltonian_of,
)

#: Options of runs that these systems have; other options of ``simulate`` are refused.
_TAKEN = ("t_end", "step", "method", "record_every", "profile", "parameters", "initial", "error_estimate", "tolerance")


def _show(path: str, method: str | None, options: Mapping[str, Any], as_json: bool) -> bool:
    from eomgen.products.fields.commands import show, show_fields  # noqa: PLC0415  # of the command line

    if (fields := field_system_of(path)) is not None:
        show_fields(fields, method, as_json=as_json)
    elif (document := hamiltonian_of(path, options)) is not None:
        show(document, method, as_json=as_json)
    else:
        return False
    return True


def _simulate(path: str, folder: str, options: Mapping[str, Any], plots: bool, as_json: bool) -> int | None:
    document = hamiltonian_of(path, {name: value for name, value in options.items() if name not in _TAKEN})
    if document is None:
        return None
    from eomgen.products.fields.commands import run  # noqa: PLC0415  # of the command line, for this kind of files

    return run(document, folder, options, plots=plots, as_json=as_json)


def _schema(*, mesh: bool) -> str:
    from eomgen.products.fields.documents.entries import json_schema  # noqa: PLC0415  # for editors alone

    return json_schema(mesh=mesh)


HAMILTONIAN_FILES = FileKind(
    "hamiltonian",
    "a Hamiltonian system",
    OF_HAMILTONIANS,
    HAMILTONIANS,
    hamiltonian_of,
    build_hamiltonian,
    generate_hamiltonian,
    _show,
    _simulate,
    {
        "hamiltonian": ("of Hamiltonian systems of coordinates", partial(_schema, mesh=False)),
        "fields": ("of fields on a mesh", partial(_schema, mesh=True)),
    },
)
