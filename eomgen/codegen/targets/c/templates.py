"""The Jinja environment of all templates: template folders of families and products, filters, and the bytecode of
templates in the cache."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from jinja2.bccache import Bucket

from eomgen.base.files import belongs_to_others, make_private_folder, template_folder
from eomgen.base.version import __version__
from eomgen.codegen.scheduling.matrix_loops import added_products
from eomgen.codegen.targets.c.naming import c_string, comment, file_name
from eomgen.codegen.targets.c.printer import Printer, indent_lines, number
from eomgen.codegen.targets.c.tables import Lookup, collapse, integers, nonzeros, offset, place, places_of_fronts
from eomgen.integrators.families.register import family_named
from eomgen.symbolic.operations import NAMES
from eomgen.system.description import LARGEST_ANGLE

_DIGEST = hashlib.sha256().digest_size


class TemplateBytecode(jinja2.BytecodeCache):
    """Bytecode in the first of some folders that can be written, which is made at first use; no bytecode is kept if
    there is none.

    A file is used if its digest is right, and if template, Python, Jinja and eomgen (whose filters may have been
    applied to constants) are the same.
    """

    def __init__(self, *folders: Path) -> None:
        self.folders = folders

    def get_cache_key(self, name: str, filename: str | None = None) -> str:
        """Return the name of a template's file."""
        text = "\0".join((name, filename or "", jinja2.__version__, __version__, f"{sys.implementation.cache_tag}"))
        return hashlib.sha256(text.encode()).hexdigest()

    def load_bytecode(self, bucket: Bucket) -> None:
        """Load the bytecode of a template (``bucket.key``) from the first folder that has a valid file, if any. Files
        and folders of other users are not read."""
        for folder in self.folders:
            with contextlib.suppress(OSError):
                file = folder / bucket.key
                kept = b"" if belongs_to_others(folder) or belongs_to_others(file) else file.read_bytes()
                if hashlib.sha256(kept[_DIGEST:]).digest() == kept[:_DIGEST]:
                    bucket.bytecode_from_string(kept[_DIGEST:])
            if bucket.code is not None:
                return

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Write the bytecode of a template with a digest to the first folder that can be written, if any. The file is
        renamed to the final name when complete."""
        code = bucket.bytecode_to_string()
        for folder in self.folders:
            with contextlib.suppress(OSError):
                make_private_folder(folder)
                handle, private = tempfile.mkstemp(prefix="tmp-", dir=folder)
                try:
                    with os.fdopen(handle, "wb") as file:
                        file.write(hashlib.sha256(code).digest() + code)
                    Path(private).replace(folder / bucket.key)
                    return
                except OSError:
                    Path(private).unlink()
                    raise


def kept_bytecode(*further: Path) -> TemplateBytecode:
    """Return the bytecode in the folder of the templates, as Python keeps the bytecode of modules, if Python may keep
    any; in further folders if that folder cannot be written."""
    folder = () if sys.dont_write_bytecode else (template_folder() / "__pycache__",)
    return TemplateBytecode(*folder, *further)


#: Under ``family/<name>/`` templates are found in the folder of a family, which may be in another distribution.
_FAMILY = "family/"


def stepper_template(family: str) -> str:
    """Return the template of a family's ``<prefix>_step.c``."""
    return f"{_FAMILY}{family}/stepper.c.jinja"


def _family_path(name: str) -> Path | None:
    """Return the file of a template ``family/<name>/<file>``; None for other names and for a file that does not exist.
    Raises UsageError for an unknown family."""
    if not name.startswith(_FAMILY):
        return None
    family, _, file = name.removeprefix(_FAMILY).partition("/")
    path = (family_named(family).templates or template_folder() / "c" / "integrators" / family) / file
    return path if path.is_file() else None


def _family_file(name: str) -> tuple[str, str, Callable[[], bool]] | None:
    """Return text and path of a template ``family/<name>/<file>``, and a function that says whether both are unchanged.
    None if there is no such file; the form is a loader's of Jinja."""
    path = _family_path(name)
    if path is None:
        return None
    text = path.read_text(encoding="utf-8")
    return text, str(path), lambda: _family_path(name) == path and path.read_text(encoding="utf-8") == text


@cache
def environment() -> jinja2.Environment:
    """Return the one Jinja environment of all templates, made at the first call, with functions and filters of this
    package. Undefined names are errors, and blocks leave no blank lines."""
    env = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.FileSystemLoader(template_folder()), jinja2.FunctionLoader(_family_file)]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
        bytecode_cache=kept_bytecode(),
    )
    env.globals["largest_angle"] = LARGEST_ANGLE
    env.globals["elementary"] = tuple(NAMES.values())
    env.globals["circular"] = ("sin", "cos")  # taken together by ``EG_SINCOS``
    env.globals["own_functions"] = ("exp", "log")  # of ``real_functions.h.jinja``, which compilers vectorise
    env.globals["lookup"] = Lookup
    env.globals["integers"] = integers
    env.globals["place"] = place
    env.globals["collapse"] = collapse
    env.globals["nonzeros"] = nonzeros
    env.globals["products"] = _products
    env.globals["places_of_fronts"] = places_of_fronts
    env.filters["comment"] = comment
    env.filters["c_string"] = c_string
    env.filters["file_name"] = file_name
    env.filters["number"] = number
    env.filters["offset"] = offset
    env.tests["contains"] = lambda container, item: item in container
    return env


def _products(rows: Sequence[Mapping[str, Any]], name: str, vector: str) -> str:
    """Return loops that add a matrix times a vector to ``right``, empty if a table of the entries is as short."""
    terms = [(row["row"], number, column) for row in rows for number, column, _ in row[name]]
    inputs = {"right": "right[{}]", "numbers": "w[{}]", "vector": f"{vector}[{{}}]", "gain": ["gain"]}
    return indent_lines(Printer(inputs, ["right"]).lines(added_products(terms, "" if name == "M" else "gain")), 1)
