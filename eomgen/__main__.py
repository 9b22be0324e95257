"""``python -m eomgen``, and the program ``eomgen``: the command line."""

from __future__ import annotations

import gc
import sys

#: Objects between two searches of the garbage collector, for young, middle-aged and old ones. Scenes and models are up
#: to millions of objects that live until the process ends.
SEARCHES = (100_000, 20, 20)


def run() -> int:
    """Run the command line, and return its exit code; Ctrl-C is heard while its parts are still imported, too."""
    gc.set_threshold(*SEARCHES)
    try:
        from eomgen.cli import main  # noqa: PLC0415

        return main()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(run())
