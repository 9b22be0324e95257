"""How a Model shows itself in a notebook: coordinates, parameters, functions, and the equations of motion as LaTeX."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from eomgen.base.html import formula, page, paragraph, table
from eomgen.system.notebook import equation


def html(
    name: str,
    layout: Mapping[str, Any],
    latex: str,
    coordinates: Iterable[Sequence[object]],
    functions: Iterable[str],
) -> str:
    """Return a page: ``coordinates`` are rows of name, unit and start; the rest comes from the library's layout."""
    made = set(functions)
    return page(
        f"Model {name}",
        paragraph(layout["description"]),
        formula(latex),
        table(("coordinate", "unit", "starts at"), coordinates),
        table(("parameter", "value", "unit", "meaning"), _named(layout["parameters"], "value", "unit", "description")),
        table(("input", "unit", "meaning"), _named(layout["inputs"], "unit", "description")),
        table(("output", "unit", "size", "meaning"), _named(layout["outputs"], "unit", "size", "description")),
        table(
            ("function", "operations", "meaning"),
            ((f["name"], f["operations"], f["description"]) for f in layout["functions"] if f["name"] in made),
        ),
    )


def latex_of(layout: Mapping[str, Any]) -> str:
    """Return the equations of motion as LaTeX, in the terms that the model has."""
    return equation(
        base=bool(layout["facts"]["moving_base"]),
        constraints=bool(layout["multipliers"]),
        states=bool(layout["states"]),
        inputs=bool(layout["inputs"]),
    )


def _named(items: Iterable[Mapping[str, Any]], *keys: str) -> Iterable[list[object]]:
    return ([item["name"], *(_short(item[key]) for key in keys)] for item in items)


def _short(value: object) -> object:
    return f"{value:.6g}" if isinstance(value, float) else value
