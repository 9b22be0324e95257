"""The interface of a library in C, which is the same for all models, and the mark of generated files."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c.printer import wrap_text
from eomgen.integrators.stepper_layout import STEPPER_CDEF

#: Signatures that are equal for all scenes, so that the generic wrapper is compiled once per machine.
INTERFACE_CDEF = f"""\
const char *eomgen_fingerprint(void);
const char *eomgen_number_type(void);
long eomgen_size(int what);
int eomgen_call(int function, long count, const double *const *inputs, const long *strides, double *const *outputs);
{STEPPER_CDEF}"""


def interface_header() -> str:
    """Return the header of the interface, which is the same for all models."""
    template = template_folder() / "c" / "interface" / "interface.h.jinja"  # has one name: no Jinja is needed
    return wrap_text(template.read_text(encoding="utf-8").replace("{{ declarations }}", INTERFACE_CDEF))


def fingerprint(files: Mapping[str, str]) -> str:
    """Return 16 hexadecimal digits that change with any byte of any C file or header."""
    digest = hashlib.sha256()
    for name in sorted(files):
        if name.endswith((".c", ".h")):
            digest.update(f"{name}\0{files[name]}\0".encode())
    return digest.hexdigest()[:16]
