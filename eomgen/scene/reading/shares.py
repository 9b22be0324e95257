"""Parts of a whole that look as if they were in percent."""

from __future__ import annotations


def percent_of_critical(ratio: float) -> str:
    """Return a note on a damping ratio above 1, a part of critical; empty for less."""
    if not ratio > 1.0:
        return ""
    hint = f"; try {ratio / 100.0:.6g}" if ratio <= 100.0 else ""
    return f"{ratio:.6g} is {100.0 * ratio:.6g} % of critical{hint}"
