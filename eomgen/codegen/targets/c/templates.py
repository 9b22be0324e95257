"""The Jinja environment of all templates: template folders of families and products, filters, and the bytecode of
templates in the cache."""

from __future__ import annotations

import contextlib
import os
import sys
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


class TemplateBytecode(jinja2.FileSystemBytecodeCache):
    """Bytecode of templates in a folder: none of damaged files, and none kept on a full disk."""

    def load_bytecode(self, bucket: Bucket) -> None:
        """Load the bytecode of a template, if there is any."""
        try:
            super().load_bytecode(bucket)
        except Exception:  # of any kind: Jinja does not check the content
            bucket.reset()

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Write the bytecode of a template, if possible."""
        with contextlib.suppress(OSError):
            super().dump_bytecode(bucket)


def kept_bytecode(*further: Path) -> TemplateBytecode | None:
    """Return the bytecode in the folder of the templates, as Python keeps the bytecode of modules, if Python may keep
    any; in the first of further folders that can be written if that folder cannot; None if none can. A folder of
    another user is not used. Names of files have the versions of Jinja and of eomgen, whose filters may have been
    applied to constants."""
    bytecode_folders = () if sys.dont_write_bytecode else (template_folder() / "__pycache__",)
    for folder in (*bytecode_folders, *further):
        with contextlib.suppress(OSError):
            make_private_folder(folder)
            if os.access(folder, os.W_OK) and not belongs_to_others(folder):
                return TemplateBytecode(str(folder), f"{__version__}-{jinja2.__version__}-%s")
    return None


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
