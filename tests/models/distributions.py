"""Distributions of others as an installation leaves them, with families of methods as entry points."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from eomgen.integrators.families.register import GROUP, families_of_others


def distribution(folder: Path, name: str, entry: str) -> Path:
    """Write what an installed distribution leaves of itself, with one entry point, and return the folder for
    ``sys.path``."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{entry}\n", encoding="utf-8")
    return folder


@pytest.fixture
def register() -> Iterator[None]:
    """Read the entry points anew, before a test and behind it."""
    families_of_others.cache_clear()
    yield
    families_of_others.cache_clear()
