"""Metadata of a solution: the description of its run."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.simulation.stepping.inputs import kind_of
from eomgen.simulation.stepping.run import Run


def run_metadata(run: Run) -> dict[str, Any]:
    """Return scene, version, method, settings, parameters, and names and units of all columns."""
    model, settings, layout = run.model, run.settings, run.model.library.layout
    return {
        "scene": model.name,
        "version": layout["version"],
        "method": run.name,
        "method_parameters": dict(run.method.keywords),
        "inputs": {
            name: kind_of(signal) if callable(signal) or isinstance(signal, np.ndarray) else signal
            for name, signal in run.signals.given.items()
        },
        "dense_output": run.method.dense_output,
        "step": settings["step"],
        "settings": dict(settings),
        **({"bounded_for": run.bounded_for} if run.bounded_for else {}),
        "record_every": run.every,
        "t_start": run.grid.start,
        "t_end": run.grid.end,
        "parameters": dict(zip(model.parameters, run.parameters.tolist(), strict=True)),
        "names": {
            "q": model.q_names,
            "v": model.v_names,
            "a": [f"a{name[1:]}" for name in model.v_names],
            "multipliers": list(model.multipliers),
            "z": model.z_names,
        },
        "units": {
            "q": model.q_units,
            "v": model.v_units,
            "z": model.z_units,
            "inputs": {item["name"]: item["unit"] for item in layout["inputs"]},
            "outputs": {o["name"]: o["unit"] for o in layout["outputs"]},
        },
        "outputs": {
            output.name: {"description": output.description, "quantity": output.quantity}
            for output in model.description.outputs
        },
        "factors": [[f.group, f.q_start, f.q_size, f.v_start, f.v_size] for f in model.factors],
        "fingerprint": layout.get("fingerprint", ""),
    }
