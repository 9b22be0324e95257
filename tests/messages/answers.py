"""Answers of the command line without their codes."""

from __future__ import annotations

import re


def plain(answer: str) -> str:
    """Return an answer without its codes."""
    return re.sub(r" \[[EW]\d{4}\]$", "", answer, flags=re.MULTILINE)
