"""What tests hold the families of linearly implicit, discontinuous and variational steps to, besides the orders."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple


class Check(NamedTuple):
    """What is held, with its bounds, and where: tests as ``file::function`` below ``tests``."""

    held: str
    tests: tuple[str, ...]


CHECKS = tuple(
    Check(check["held"], tuple(check["tests"]))
    for check in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["check"]
)


def listed() -> str:
    """Return the checks as a list of Markdown."""
    lines = []
    for check in CHECKS:
        by_file: dict[str, list[str]] = {}
        for one in check.tests:
            file, _, function = one.partition("::")
            by_file.setdefault(file, []).append(f"`{function}`")
        where = "; ".join(f"`tests/{file}`: {', '.join(functions)}" for file, functions in by_file.items())
        lines.append(f"- {check.held[0].upper()}{check.held[1:]}. {where}\n")
    return "".join(lines)
