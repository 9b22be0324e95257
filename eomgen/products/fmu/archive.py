"""The archive of an FMU: model description, sources, library, documentation, licences and reference results."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from typing import Any

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c.templates import environment
from eomgen.products.fmu.arrays import listed
from eomgen.products.fmu.dae import VERSION
from eomgen.products.fmu.interface import Interface, event_rows

#: Kinds of variables of FMI-LS-DAE.
_LAYER = ("switch", "algebraic", "residual", "drift")
#: Time of all files in the archive, so that the same model gives the same bytes.
_TIME = (1980, 1, 1, 0, 0, 0)


def token_of(texts: Mapping[str, str]) -> str:
    """Return the token of texts, in the form of a GUID."""
    digest = hashlib.sha256()
    for name, text in sorted(texts.items()):
        digest.update(f"{name}\0{text}\0".encode())
    mark = digest.hexdigest()
    return f"{{{mark[:8]}-{mark[8:12]}-{mark[12:16]}-{mark[16:20]}-{mark[20:32]}}}"


def documents(interface: Interface, **names: Any) -> dict[str, str]:
    """Return the documentation of an FMU by path in the archive; ``names`` are further names for the templates. It
    consists of a page, the licence of the model as far as the user states one, and the licence of eomgen's sources."""
    template, program = environment().get_template, interface.program
    rows = listed(interface)
    rendered = {
        "interface": interface,
        "program": program,
        "about": interface.options.about,
        "quaternions": any(factor["group"] != "R" for factor in program.factors),
        "rows": [row for row in rows if row.variable.kind not in _LAYER],
        "layer": [row for row in rows if row.variable.kind in _LAYER],
        "dae": VERSION if interface.options.dae else "",
        "events": len(event_rows(program)),
        "samples": bool(program.method.get("samples")),
        **names,
    }
    page = template("fmu/index.html.jinja").render(rendered)
    files = {"index.html": page, "licenses/license.txt": template("fmu/license.txt.jinja").render(rendered)}
    files["licenses/eomgen.txt"] = (template_folder() / "fmu" / "LICENSE.txt").read_text(encoding="utf-8")
    if interface.options.about.license_text:
        files["licenses/model.txt"] = interface.options.about.license_text
    return {f"documentation/{name}": text for name, text in files.items()}


def packed(files: Mapping[str, str | bytes]) -> bytes:
    """Return an archive of files by path, with the model description first."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda path: (path != "modelDescription.xml", path)):
            content = files[name]
            entry = zipfile.ZipInfo(name, _TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content.encode() if isinstance(content, str) else content)
    return stream.getvalue()
