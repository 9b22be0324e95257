"""Names of attributes of the product pictures in other programs, and the remedy, by class, for messages."""

from __future__ import annotations

ATTRIBUTES: dict[str, dict[str, str]] = {
    "Model": {"animate": "simulate(...).animate(path)"},
    "Solution": dict.fromkeys(("animation", "show"), "animate(path)"),
}
