"""Demands that several contracts share: partials against complex steps, and generated C that compiles alone."""

from __future__ import annotations

import json
import shlex
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.pipeline.generation import generate
from eomgen.products.testing.states import (
    Array,
    derivative,
    jacobian,
    on_base,
    random_states,
    relative_error,
    tape_evaluator,
)
from eomgen.scene.scene import Scene

#: Relative errors of partials and of power balances that count as rounding.
PARTIALS = POWER = 1e-10
_STRICT = ("-Wall", "-Wextra", "-Werror")


class ContractError(AssertionError):
    """A contract that is broken: the subject, the demand, and the error."""


def demand(met: bool, subject: str, fault: str) -> None:
    """Raise ContractError with subject and fault unless a demand is met."""
    if not met:
        raise ContractError(f"{subject}: {fault}")


def partials_error(scene: Scene, states: Mapping[str, Array] | None = None, seed: int = 0) -> float:
    """Return the largest relative error of the partials K and C of the residual against complex steps.

    The functions are evaluated as recorded, in NumPy; no C is compiled.

    Parameters
    ----------
    scene : Scene
        A scene without laws in files, which have no complex arguments.
    states : mapping, optional
        Blocks of four states by name, (4, size) each, in place of random ones. Multipliers ``lam`` and internal states
        ``z`` are never random: a scene with constraints or internal states needs them here.
    seed : int
        Of random states.

    Raises
    ------
    ValueError
        Multipliers or internal states are missing.
    """
    system = derive(scene, ["residual", "partials"])
    evaluate = tape_evaluator(system)
    state = {**random_states(system, 4, np.random.default_rng(seed)), **(states or {})}
    state = on_base(evaluate, state) if "base" in system.functions else state
    partials = evaluate("partials", state)
    return max(
        relative_error(partials[name], jacobian(evaluate, system.factors, "residual", "r", state, block), 2)
        for name, block in (("K", "q"), ("C", "v"))
    )


def power_error(scene: Scene, states: Mapping[str, Array] | None = None, seed: int = 0) -> float:
    """Return the largest relative difference between the rate of energy along the motion and the power of the forces.
    The rate follows from accelerations by forces and potentials, the power from the sum in the law. ``states`` has
    blocks of six states by name, (6, size) each, random by ``seed`` if not given; internal states ``z`` are never
    random.
    """
    system = derive(scene, ["energy", "forward_dynamics"])
    evaluate = tape_evaluator(system)
    state = {**random_states(system, 6, np.random.default_rng(seed)), **(states or {})}
    state["a"] = evaluate("forward_dynamics", state)["vdot"]
    rates = {"q": state["v"], "v": state["a"], "t": np.ones((len(state["q"]), 1))}
    rate = derivative(evaluate, system.factors, "energy", state, rates)["energy"]
    power = evaluate("energy", state)["energy"][:, 2]
    scale = np.abs(rate[:, 0]) + np.abs(rate[:, 1]) + np.abs(power)
    return float(np.max(np.abs(rate[:, 0] + rate[:, 1] - power) / np.maximum(scale, 1e-300)))


def compile_c(scene: Scene, folder: Path) -> Path:
    """Generate the C of a scene in a folder, compile the files alone, and return the path of the program.

    Raises
    ------
    ContractError
        With the compiler's first lines, if the C has warnings or errors.
    """
    generate(scene, folder)
    command = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["compile"]
    run = subprocess.run([*shlex.split(command), *_STRICT], cwd=folder, capture_output=True, text=True, check=False)
    first = "\n".join(run.stderr.splitlines()[:6])
    demand(run.returncode == 0, scene.name, f"the generated C does not compile without warnings:\n{first}")
    return folder / scene.name


def check_c(scene: Scene) -> None:
    """Check that the generated C of a scene compiles alone without warnings. Raises ContractError."""
    with tempfile.TemporaryDirectory() as folder:
        compile_c(scene, Path(folder))
