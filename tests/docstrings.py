"""Validation of public docstrings by numpydoc, a part of ``make lint``: ``python -m tests.docstrings``.

Public are the names on the pages of the reference (``docs.site.reference``). All checks of numpydoc hold for them,
apart from ``LEFT_OUT``. Fields of a class stand under Attributes, or under Parameters if callers construct it.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from typing import NamedTuple

from docs.site.reference import members, public_objects

COMMAND = "python -m tests.docstrings"
#: Checks of numpydoc that are left out, each with the reason.
LEFT_OUT = {
    "GL01": "the summary stands on the line of the quotes, as the formatter of this repository leaves it",
    "GL02": "the same for the closing quotes of short docstrings",
    "SS06": "a summary of one sentence may take two lines of 120 columns; lists of names show all of it",
    "ES01": "a summary that says all needs no second paragraph",
    "SA01": "pages of the reference list all names of their subject, and the side lists the neighbours",
    "EX01": "tests/test_contract_texts.py holds which functions have an example",
    "RT02": "results have the symbol of the equations as their name: ``M : (..., nv, nv) ndarray``",
}


class Finding(NamedTuple):
    """A finding: public name, code of the check, and numpydoc's message."""

    name: str
    code: str
    message: str


def names() -> Iterator[tuple[str, object]]:
    """Yield the name and the object of each public class, function and member."""
    for name, (_, value) in public_objects().items():
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            yield name, value
            yield from ((f"{name}.{member}", member_value) for member, _, member_value in members(value))


def undocumented(message: str, value: object) -> set[str]:
    """Return the arguments that a finding PR01 names: of classes without those under Attributes, and none of a class
    that callers do not construct, which has no section Parameters; of methods without the model or the solution."""
    missing = set(re.findall(r"'([^']+)'", message)) - {"model", "solution"}
    if not inspect.isclass(value):
        return missing
    text = inspect.getdoc(value) or ""
    if "Parameters\n---" not in text:
        return set()
    attributes = re.findall(r"^(\w[\w, ]*) ?:", text.partition("Attributes\n---")[2], re.MULTILINE)
    return missing - {name for line in attributes for name in re.split(r", ?", line.strip())}


def findings_of(name: str, value: object) -> list[Finding]:
    """Return the findings on one public name."""
    from numpydoc.validate import validate

    found = [Finding(name, code, message) for code, message in validate(name)["errors"]]
    return [
        item
        for item in found
        if item.code not in LEFT_OUT and not (item.code == "PR01" and not undocumented(item.message, value))
    ]


def main() -> int:
    """Print all findings; return 1 if there are any."""
    found = [item for name, value in names() for item in findings_of(name, value)]
    sys.stdout.writelines(f"{item.name}: {item.code} {item.message}\n" for item in found)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
