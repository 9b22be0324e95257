"""Files that the verbs of pages refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.failures.failure import invoked

#: Readers of files: ending, call and exit code.
READERS: dict[str, tuple[str, Callable[[Path], object], int]] = {
    "report": (".toml", lambda path: invoked("report", str(path), "--out", str(path.with_name("r.html"))), 7),
}
