"""``python -m eomgen``, and the program ``eomgen``: the command line."""

from __future__ import annotations

import gc
import sys

#: Thresholds of the garbage collector for its three generations. Scenes and models are up to millions of objects that
#: live until the process ends, and the defaults would search these again and again.
COLLECTOR_THRESHOLDS = (100_000, 20, 20)


def run() -> int:
    """Run the command line, and return its exit code; Ctrl-C is heard while its parts are still imported, too."""
    gc.set_threshold(*COLLECTOR_THRESHOLDS)
    try:
        from eomgen.cli import main  # noqa: PLC0415

        return main()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(run())
