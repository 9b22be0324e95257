"""Draw the diagrams of the pages on scene sections: ``python -m docs.diagrams docs/scene/diagrams``."""

from __future__ import annotations

import sys
from pathlib import Path

from docs.diagrams import mechanics, signals
from docs.diagrams.register import DIAGRAMS

__all__ = ["DIAGRAMS", "mechanics", "signals"]


def main(arguments: list[str]) -> int:
    """Write all diagrams to a folder."""
    (folder,) = map(Path, arguments)
    folder.mkdir(parents=True, exist_ok=True)
    for diagram in DIAGRAMS.values():
        (folder / f"{diagram.page}.svg").write_text(diagram.svg(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
