"""``python -m tests.messages``: numbers new messages, and renews the examples of codes."""

from __future__ import annotations

import sys

from tests.messages.catalogue import main

if __name__ == "__main__":
    sys.exit(main())
