"""Content that decides the key of a library in the cache, as bytes, without deriving anything: document, front end,
terms, method and code."""

from __future__ import annotations

import hashlib
import inspect
import json
from pathlib import Path

from eomgen.base.version import __version__, checkout_stamp
from eomgen.errors import UsageError
from eomgen.pipeline.front_end import Document, FrontEnd
from eomgen.pipeline.scenes import SCENES
from eomgen.system.terms import Selection


def fingerprint(document: Document, front_end: FrontEnd) -> str:
    """Return 16 hexadecimal digits that identify the equations, for any terms and stepper of a library."""
    stamps = json.dumps([front_end.name, _stamp(front_end), __version__])
    return hashlib.sha256(front_end.content(document) + b"\0" + stamps.encode()).hexdigest()[:16]


def library_content(document: Document, front_end: FrontEnd, selection: Selection, method: str) -> bytes:
    """Return the bytes that decide the key of a library in the cache: document, notes of reading the document, which
    the library keeps, front end, terms, method, version and code. Flags and compiler are not among these, and no
    equations are derived. Raises UsageError without a digest."""
    from eomgen.integrators.families.register import stamp_of  # noqa: PLC0415

    content = front_end.content(document)
    if not content:
        fault = f"this {type(document).__name__} was made by hand, without a digest of its content [E0522]"
        raise UsageError(fault, "eomgen.SceneBuilder or eomgen.load")
    options = {
        **vars(selection),
        "method": method,
        "notes": front_end.describe(document).notes,
        "front_end": [front_end.name, _stamp(front_end)],
        "version": __version__,
        "code": checkout_stamp(),
        "family": stamp_of(method),
    }
    return content + b"\0" + json.dumps(options, sort_keys=True).encode()


def _stamp(front_end: FrontEnd) -> str:
    """Return a digest of the file of another distribution's front end; empty for eomgen's own."""
    if front_end is SCENES:
        return ""
    return hashlib.sha256(Path(inspect.getfile(front_end.derive)).read_bytes()).hexdigest()
