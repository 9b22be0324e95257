"""``python -m eomgen``: the command line."""

from __future__ import annotations

import sys

from eomgen.cli import main

sys.exit(main())
