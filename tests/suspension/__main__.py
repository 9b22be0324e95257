"""``python -m tests.suspension DIR``: differences to all rows of ``DIR/suspension/double_wishbone_bump.csv``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tests.suspension.hard_points import positions


def main(folder: Path) -> int:
    """Print the largest difference of each position of the wheel, and of all."""
    table = np.loadtxt(folder / "suspension/double_wishbone_bump.csv", delimiter=",", skiprows=1)
    found = positions(table[:, 0].tolist())
    differences = [float(np.abs(np.ravel(own) - row[1:16]).max()) for own, row in zip(found, table, strict=True)]
    for travel, difference in zip(table[:, 0], differences, strict=True):
        print(f"{travel:6.0f} mm {difference:9.1e} mm")
    print(f"largest {max(differences):.1e} mm of {15 * len(table)} coordinates")
    return int(max(differences) > 2e-9)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
