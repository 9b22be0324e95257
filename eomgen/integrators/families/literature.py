"""Papers of the methods, as BibTeX: the register by the names in ``source`` of a method.

Titles and pages follow the references of the methods' docstrings and have not been compared with the journals; ``note``
names data that are known to be incomplete.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

_ENTRIES = re.compile(r"^(.+)\n(@\w+\{(?s:.*?)^\})", re.MULTILINE)
#: BibTeX entries by the names in ``source``: authors and year.
PAPERS: Mapping[str, str] = dict(_ENTRIES.findall(Path(__file__).with_suffix(".bib").read_text(encoding="utf-8")))


def papers_of(source: str) -> Iterator[str]:
    """Yield the papers that a method's ``source`` names, in the order of the text, as BibTeX."""
    there = [name for name in PAPERS if name in source]
    yield from (PAPERS[name] for name in sorted(there, key=source.index))
