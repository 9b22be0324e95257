"""``python -m tests.messages``: writes the catalogue of messages with their codes."""

from __future__ import annotations

import sys

from tests.messages.catalogue import main

if __name__ == "__main__":
    sys.exit(main())
