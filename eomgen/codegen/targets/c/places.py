"""Texts of places in arrays: equally spaced ones, choices between ranges, and places that move with each period."""

from __future__ import annotations

from collections.abc import Sequence


def place(start: int, step: int, counter: str = "i") -> str:
    """Return the text of start + step i."""
    if step == 0:
        return str(start)
    term = counter if abs(step) == 1 else f"{abs(step)} * {counter}"
    if step < 0:
        return f"{start} - {term}"
    return f"{start} + {term}" if start else term


def moved(first: str, step: int, counter: str = "k") -> str:
    """Return the text of a place that moves by a step with each count."""
    if step == 0:
        return first
    return f"{first} {'+' if step > 0 else '-'} {f'{abs(step)} * ' if abs(step) > 1 else ''}{counter}"


def chosen(ranges: Sequence[tuple[int, str]], counter: str = "k") -> str:
    """Return a choice between texts by ranges of a counter, each with its end."""
    text = ranges[-1][1]
    for end, other in reversed(ranges[:-1]):
        text = f"{counter} < {end} ? {other} : {text}"
    return text
