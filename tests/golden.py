"""The golden C code in ``generated/``: written by ``eomgen.generate``, compared byte by byte, accepted by one command.

python -m tests.golden             show what would change
python -m tests.golden --update    accept it (make golden)
"""

from __future__ import annotations

import argparse
import difflib
import shutil
import sys
import tempfile
from pathlib import Path

import eomgen

ROOT = Path(__file__).parents[1]
GENERATED = ROOT / "generated"
#: Golden folder -> scene file in examples/.
SCENES = {
    "active_vehicle": "active_vehicle/scene.toml",
    "bouncing_ball": "bouncing_ball/scene.toml",
    "heavy_top_r3xso3": "heavy_top/r3xso3.toml",
    "pendulum_on_shaking_base": "pendulum_on_shaking_base/scene.toml",
    "spherical_pendulum": "spherical_pendulum/scene.toml",
}
ACCEPT = "if this change of the C code is meant: make golden (python -m tests.golden --update), and look at the diff"


def generated_files(name: str) -> dict[str, str]:
    """Return the files that eomgen writes for an example today."""
    with tempfile.TemporaryDirectory() as folder:
        paths = eomgen.generate(ROOT / "examples" / SCENES[name], Path(folder) / name)
        return {path.name: path.read_bytes().decode() for path in paths}


def committed_files(name: str, folder: Path = GENERATED) -> dict[str, str]:
    """Return the files of a golden folder; none where there is no such folder."""
    found = folder / name
    return {path.name: path.read_bytes().decode() for path in sorted(found.iterdir())} if found.is_dir() else {}


def difference(name: str, committed: dict[str, str], current: dict[str, str]) -> str:
    """Return a unified diff over all files of a folder; empty where every byte is the same."""
    lines: list[str] = []
    for file in sorted(committed.keys() | current.keys()):
        old, new = committed.get(file, ""), current.get(file, "")
        if old == new and (file in committed) == (file in current):
            continue
        before = f"generated/{name}/{file}" if file in committed else "/dev/null"
        after = f"generated/{name}/{file}" if file in current else "/dev/null"
        diff = difflib.unified_diff(old.splitlines(True), new.splitlines(True), before, after)
        lines += [line if line.endswith("\n") else f"{line}\n\\ no newline at end of file\n" for line in diff]
        if old == new or not (old or new):
            lines.append(f"--- {before}\n+++ {after}\n")
    return "".join(lines)


def strangers() -> list[str]:
    """Return what lies in ``generated/`` and is the golden folder of no scene."""
    return sorted(path.name for path in GENERATED.iterdir() if path.name not in SCENES)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="write what eomgen generates today to generated/")
    update = parser.parse_args(arguments).update
    changed = False
    for name, scene in SCENES.items():
        current = generated_files(name)
        diff = difference(name, committed_files(name), current)
        changed = changed or bool(diff)
        if not update:
            sys.stdout.write(diff)
            continue
        if (GENERATED / name).is_dir():
            shutil.rmtree(GENERATED / name)
        eomgen.generate(ROOT / "examples" / scene, GENERATED / name)
        print(f"generated/{name}: {'changed' if diff else 'as before'}, {len(current)} files")
    if update:
        for name in strangers():
            print(f"generated/{name}: belongs to no scene; remove it, or add it to SCENES in tests/golden.py")
    elif changed:
        print(ACCEPT)
    return int(changed and not update)


if __name__ == "__main__":
    sys.exit(main())
