"""The page docs/mjcf.md: how eomgen takes each element and attribute of MuJoCo's own grammar. ``python -m
tests.robots.mjcf_grammar docs/mjcf.md`` renews it; it needs the package mujoco."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import mujoco

from eomgen.products.robots.mjcf.coverage import STATUSES, key_of_path
from tests.robots.tables import MEANINGS

COMMAND = "python -m tests.robots.mjcf_grammar docs/mjcf.md"
PAGE = Path(__file__).parents[2] / "docs" / "mjcf.md"
_LINE = re.compile(r"^( *)(\(world\)body|[a-z_]+) \(([!?*R])\) *(.*)$")


def grammar() -> dict[str, tuple[str, ...]]:
    """Return the attributes of each element by its path, as ``actuator/motor``, of the installed MuJoCo."""
    result: dict[str, list[str]] = {}
    path: list[str] = []
    attributes: list[str] = []
    for line in mujoco.mj_printSchema(False, False).splitlines():
        match = _LINE.match(line)
        if match is None:
            attributes += line.split()
            continue
        depth = len(match[1]) // 3
        path[depth:] = [match[2].replace("(world)", "")]
        attributes = result.setdefault(key_of_path("/".join(path[1:]) or "mujoco"), [])
        attributes += match[4].split()
    return {key: tuple(dict.fromkeys(names)) for key, names in result.items()}


def _described_elsewhere(key: str) -> bool:
    """Return whether an element of defaults has the statuses of the element that it describes."""
    outer, _, name = key.partition("/")
    others = [STATUSES[other] for other in grammar() if other.endswith(f"/{name}") and not other.startswith("default")]
    pairs = STATUSES[key].items()
    return outer == "default" and bool(name) and any(pairs <= other.items() for other in others)


def page() -> str:
    """Return the text of the page."""
    version = ".".join(mujoco.__version__.split(".")[:2])
    lines = [
        "# MJCF: every attribute\n",
        f"How eomgen takes each attribute of the grammar that MuJoCo {version} prints (`mj_printSchema`);",
        "[MJCF](scene/mjcf.md) lists the elements with their counterparts in scenes.",
        f"The table is made by `{COMMAND}`, and a test compares it with the grammar of the installed MuJoCo.\n",
        "| | |\n|---|---|",
        *(f"| {status} | {meaning} |" for status, meaning in MEANINGS.items()),
        "\nAn attribute that is not in this table, of a newer MuJoCo, is noted, and refused with `--strict`.",
        "MuJoCo refuses attributes that it does not know. Elements below `default` without a row are taken as the",
        "elements that they describe.\n",
        "| element | attributes |\n|---|---|",
    ]
    rows: dict[str, list[str]] = {}
    for key, attributes in sorted(grammar().items()):
        by_status = {status: [name for name in attributes if STATUSES[key].get(name) == status] for status in MEANINGS}
        texts = [f"**{status}**: {', '.join(names)}" for status, names in by_status.items() if names]
        if texts and not _described_elsewhere(key):
            rows.setdefault("; ".join(texts), []).append(f"`{key}`")
    lines += [f"| {', '.join(keys)} | {text} |" for text, keys in rows.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
