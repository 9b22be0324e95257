"""How a System shows itself: one line at a prompt, counts and formulas in a notebook, LaTeX; and how a Model does, with
coordinates, parameters and functions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from eomgen.base.html import formula, page, paragraph, table


def line(name: str, sizes: Mapping[str, int], flops: Mapping[str, int]) -> str:
    """Return a line on a system: ``<System arm: nq 2, nv 2; operations: mass 12, coupling 30, force 20, and 8 more>``.
    ``sizes`` are numbers of coordinates and the like, ``flops`` the operations of functions, both by name."""
    counted = ", ".join(f"{function} {count}" for function, count in list(flops.items())[:5])
    if (more := len(flops) - 5) > 0:
        counted += f", and {more} more"
    return f"<System {name}: {_sizes(sizes)}; operations: {counted}>"


def system_page(
    name: str,
    description: str,
    sizes: Mapping[str, int],
    formulas: Iterable[str],
    functions: Iterable[Sequence[object]],
) -> str:
    """Return the HTML text about a system: sizes, formulas, and a table of functions. ``formulas`` are LaTeX;
    ``functions`` are rows of name, inputs, operations and meaning."""
    return page(
        f"System {name}",
        paragraph(description),
        paragraph(_sizes(sizes)),
        *(formula(text) for text in formulas),
        table(("function", "of", "operations", "meaning"), functions),
    )


def equation(*, base: bool, constraints: bool, states: bool, inputs: bool) -> str:
    """Return the equations of motion as LaTeX, in the terms that a system has."""
    moved = r" + b(q, v, t)" if base else ""
    held = r" + B(q, t)^{\mathsf T} \lambda" if constraints else ""
    arguments = ", ".join(("q", "v", *(("z",) if states else ()), "t", *(("u",) if inputs else ())))
    return rf"M(q)\,\dot v + h(q, v){moved}{held} = Q({arguments})"


def _sizes(sizes: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {size}" for name, size in sizes.items() if size)


def model_page(
    name: str, layout: Mapping[str, Any], latex: str, coordinates: Iterable[Sequence[object]], functions: Iterable[str]
) -> str:
    """Return the HTML text about a compiled model, with tables of coordinates, parameters, inputs, outputs and
    functions. ``coordinates`` are rows of name, unit and start; ``functions`` names the functions in the library, whose
    data come from the library's ``layout``; ``latex`` is the equation of motion."""
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
