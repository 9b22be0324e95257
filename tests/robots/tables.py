"""Cases of tests in text files beside them: a paragraph for each case, with an arrow before each further field."""

from __future__ import annotations

import re
from pathlib import Path


def table(name: str) -> list[tuple[str, ...]]:
    """Return the fields of each case of a file; a line within a field is ended by ``\\n``."""
    text = Path(__file__).with_name(f"{name}.txt").read_text(encoding="utf-8")
    return [tuple(re.split("\n-> ?", case.replace("\\n", "\n"))) for case in text.strip("\n").split("\n\n")]
