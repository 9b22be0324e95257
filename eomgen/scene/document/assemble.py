"""Assembly of nested data, from a file or a builder, into a checked Scene; all problems are reported together.

The sections of a scene are the rows of ``document.rows``, from the register ``scene/sections``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from eomgen.base.messages import key_of
from eomgen.errors import Message
from eomgen.scene.document.checks import CHECKS, LAST_CHECKS, check_names
from eomgen.scene.document.notes import SceneFacts, notes_of
from eomgen.scene.document.units import in_si
from eomgen.scene.document.validation import read_document
from eomgen.scene.formula.namespaces import FileData
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.report import Report
from eomgen.scene.scene import Scene
from eomgen.scene.section import Reading, in_reading_order, join
from eomgen.scene.sections import OFFERED, bounds_of
from eomgen.system import description

if TYPE_CHECKING:
    from eomgen.scene.document.schema import SceneDocument


def assemble(
    part: FileData,
    report: Report,
    *,
    notes: Sequence[str],
    metadata: Mapping[str, Any],
    inertias_checked: bool,
    coordinates: Literal["joint", "absolute"] | None,
    folder: Path,
) -> Scene:
    """Check the data of a scene, with included files, and return the Scene; arguments as for ``load.from_data``. Raises
    DescriptionError with all problems."""
    data, labels, units = in_si(part.data, report)
    document, refused = read_document(data, report)
    if coordinates is not None:
        document = document.model_copy(update={"coordinates": coordinates})
    document = check_names(document, refused, report)
    bodies = data.get("bodies", ()) if inertias_checked else part.judged
    judged = {key_of("bodies", body, field) for body in bodies for field in ("mass", "inertia")}
    rows = document.rows
    reading = Reading(document, refused, data, rows, report, folder, judged, bounds_of(rows), units, OFFERED)
    fields = _fields(reading, document, part.bound)
    report.raise_problems()
    return Scene(
        **fields,
        source={key: report.place(key) for key in report.lines},
        content=b"checked",
        notes=tuple(
            map(Message, (*notes, *part.notes, *labels, *notes_of(SceneFacts(part.data, document, fields, reading))))
        ),
        metadata=metadata,
    )


def _fields(reading: Reading, document: SceneDocument, bound: Mapping[str, str]) -> dict[str, Any]:
    """Read and check all sections, and return the arguments of the Scene by field; these are valid only if the report
    of ``reading`` stays empty, and ``reading.items`` is filled. ``bound`` has formulas for parameters of included files
    by key."""
    ordered = in_reading_order(reading.rows)
    model = [row for row in ordered if not row.last]
    observers = [row for row in ordered if row.last]
    fields: dict[str, Any] = {
        "name": document.name,
        "description": document.description,
        "terms": tuple(dict.fromkeys(document.terms)),
        "coordinates": document.coordinates,
        "task_frames": tuple(dict.fromkeys(document.task_frames)),
    }
    for key, text in bound.items():
        reading.reader().formula(key, text, PARAMETERS)
    for rows, checks in ((model, CHECKS), (observers, LAST_CHECKS)):
        for row in rows:
            reading.items[row.key] = row.read(reading)
            row.check(reading)
        for check in checks:
            check(document, reading)
    for row in reading.rows:
        join(fields, row.fields(reading))
    return {
        **fields,
        "parts": {key: items for key, items in fields.get("parts", {}).items() if items},
        "parameters": tuple(reading.parameters),
        "requirements": tuple(reading.values.requirements),
        "simulation": description.Simulation(**dict(document.simulation)),
    }
