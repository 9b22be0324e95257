"""Validation of public docstrings by numpydoc, a part of ``make lint``: ``python -m tests.docstrings``.

Public are the names on the pages of the reference (``docs.site.reference``). All checks of numpydoc hold for them,
apart from ``LEFT_OUT``; the checks of ``SECTIONS`` hold for methods and functions of ``eomgen`` and of Simulator.
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
    "PR04": "arguments that another function describes have a reference to the function in place of a type",
    "PR07": "``step : float, s`` says all of many arguments; names that share a description stand on one line",
    "PR08": "descriptions are phrases with units and shapes, and begin with a small letter where the schema has them",
    "PR09": "the same: phrases end without a period where the schema has them",
    "RT02": "results have the symbol of the equations as their name: ``M : (..., nv, nv) ndarray``",
    "RT03": "the summary says the meaning of a single result, the type says the shape",
    "RT04": "as PR08",
    "RT05": "as PR09",
}
#: Checks that the whole public interface does not meet yet: sections for arguments and results, Yields of iterators.
SECTIONS = ("PR01", "RT01", "YD01")


class Finding(NamedTuple):
    """A finding: public name, code of the check, and numpydoc's message."""

    name: str
    code: str
    message: str


def names() -> Iterator[tuple[str, bool]]:
    """Yield each public class, function and member, and whether the checks of sections hold for it."""
    for name, (_, value) in public_objects().items():
        of_core = name.count(".") == 1 or name.endswith(".Simulator")
        if inspect.isfunction(value):
            yield name, of_core
        elif inspect.isclass(value):
            yield name, False  # fields and attributes stand in sections of their own choice
            yield from ((f"{name}.{member}", of_core) for member, _, _ in members(value))


def findings_of(name: str, sections: bool) -> list[Finding]:
    """Return the findings on one public name."""
    from numpydoc.validate import validate

    found = [Finding(name, code, message) for code, message in validate(name)["errors"]]
    return [
        item
        for item in found
        if item.code not in LEFT_OUT
        and (sections or item.code not in SECTIONS)
        and not (item.code == "PR01" and re.findall(r"'([^']+)'", item.message) == ["model"])  # methods of Model: self
    ]


def main() -> int:
    """Print all findings; return 1 if there are any."""
    found = [item for name, sections in names() for item in findings_of(name, sections)]
    sys.stdout.writelines(f"{item.name}: {item.code} {item.message}\n" for item in found)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
