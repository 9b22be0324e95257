"""``python -m eomgen``, and the program ``eomgen``: the command line."""

from __future__ import annotations

import sys


def run() -> int:
    """Run the command line, and return its exit code; Ctrl-C is heard while its parts are still imported, too."""
    try:
        from eomgen.cli import main  # noqa: PLC0415

        return main()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(run())
