"""Distributions that tests install in a folder."""

from __future__ import annotations

from pathlib import Path

import pytest


def install(folder: Path, patch: pytest.MonkeyPatch, name: str, entries: str) -> Path:
    """Install a distribution with entry points in a folder that imports look into; return the file of the entries."""
    information = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (information / "entry_points.txt").write_text(entries, encoding="utf-8")
    patch.syspath_prepend(folder)
    return information / "entry_points.txt"
