"""``python -m tests.contacts DIR``: differences to whole tables of MFeval, ``DIR/magic_formula``, by version and mode.

For each quantity the largest difference relative to the largest number of its column, and relative to each number.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from eomgen.products.contacts.tyre_files import read_tyre_file
from tests.anchors.runs import table
from tests.contacts.states import results_at


def main(folder: Path) -> int:
    """Print the differences of all tables in a folder."""
    for file in sorted(folder.glob("magic_formula/mfeval_*_mode*.csv")):
        tyre, mode = file.stem.removeprefix("mfeval_").rsplit("_mode", 1)
        _, columns = table(file)
        states = np.column_stack([columns[name] for name in ("Fz", "kappa", "alpha", "gamma", "Vx", "pressure")])
        content = read_tyre_file(file.with_name(f"{tyre}.tir"))
        print(f"{tyre}: version {content.version}, mode {mode}, {len(states)} states")
        for name, own in results_at(content.version, content.numbers, states, mode).items():
            other = columns[name]
            off = np.abs(own - other)
            print(f"  {name:<7}{(off / np.abs(other).max()).max():9.1e}{(off / np.abs(other)).max():9.1e}")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
