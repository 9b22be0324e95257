"""Analyses of scenes that move continuously: none where states are sampled."""

from __future__ import annotations

from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem


def check_continuous(model: CompiledModel, what: str) -> None:
    """Raise ModelError where states are sampled: between samples they stay, whatever the motion.

    Parameters
    ----------
    what : name of the analysis
    """
    layout = model.library.layout
    if layout["sampled"]:
        names = ", ".join(layout["states"][int(item["state"])]["name"] for item in layout["sampled"])
        problem = f"the states {names} are sampled: between samples they stay as they are, so they have no equilibrium"
        hint = "a run of simulate; or the scene with inputs in place of sampled states"
        raise ModelError(Problem(what, f"{problem} and no linear model in continuous time", hint))
