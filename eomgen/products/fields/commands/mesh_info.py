"""Output of ``info`` for a system of fields on a mesh."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from eomgen.base.text import counted
from eomgen.cli.printing import print_json
from eomgen.cli.tables import print_table

if TYPE_CHECKING:
    from eomgen.products.fields.documents.fields import FieldSystem


def show(system: FieldSystem, method: str | None, *, as_json: bool) -> None:
    """Print mesh, memory, operators, data, energy and method, without an array of the mesh's size."""
    from eomgen.integrators.compositions import composition_named  # noqa: PLC0415
    from eomgen.products.fields.sampling import at_settings, memory_of  # noqa: PLC0415

    memory = memory_of(system)
    with at_settings(system, () if method is None else ("method",)):
        chosen = composition_named(system.sampling.method if method is None else method)
    widths = [length / count for length, count in zip(system.lengths, system.cells, strict=True)]
    low, high = 2.0 * math.pi / max(system.lengths), math.pi / max(widths)
    transforms = 2 * len(system.fields)
    operators = {item.name: f"{item.kind}{f' after {item.of}' if item.of else ''}" for item in system.operators}
    data = {item.name: item.kind + (f" {item.file}" if item.file else "") for item in system.data}
    if as_json:
        print_json(
            {
                "system": system.name,
                "description": system.description,
                "cells": list(system.cells),
                "lengths": list(system.lengths),
                "memory": memory,
                "wave_numbers": [low, high],
                "operators": operators,
                "data": data,
                "energy": system.energy,
                "where": dict(system.where),
                "fields": list(system.fields),
                "transforms_per_gradient": transforms,
                "mass": system.mass,
                "sampling": dataclasses.asdict(system.sampling),
                "method": {
                    "name": chosen.name,
                    "order": chosen.order,
                    "gradients": chosen.gradients,
                    "stability_limit": chosen.stability_limit,
                },
            }
        )
        return
    unit = f" {system.unit}" if system.unit else ""
    rows = [
        ("mesh", f"{' x '.join(map(str, system.cells))} cells of {' x '.join(f'{w:.6g}' for w in widths)}{unit}"),
        ("wave numbers", f"{low:.4g} to {high:.4g} along the axes, radians per {system.unit or 'length'}"),
        ("memory", f"{memory / 2**20:.4g} MiB at most, with {counted(system.sampling.chains, 'chain')}"),
        *(("operator", f"{name}: {meaning}") for name, meaning in operators.items()),
        *(("data", f"{name}: {meaning}") for name, meaning in data.items()),
        *(("where", f"{name} = {text}") for name, text in system.where.items()),
        ("energy of a cell", system.energy),
        ("gradient", f"{counted(transforms, 'transform')}, of {', '.join(system.fields)}"),
        ("mass", system.mass),
        (
            "method",
            f"{chosen.name}, order {chosen.order}, {counted(chosen.gradients, 'gradient')} a step, stable up to step x"
            f" frequency = {chosen.stability_limit:.4g}",
        ),
    ]
    print_table(system.name, ("", ""), rows)
