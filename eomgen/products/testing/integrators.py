"""The contract of an integration method."""

from __future__ import annotations

import subprocess
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.pipeline.pipeline import build
from eomgen.products.testing.demands import compile_c, demand
from eomgen.scene.load import from_data, load_toml

#: A double pendulum with a ball joint: coordinates that are numbers, and a quaternion.
_SCENE = """
format = 1
name = "contract"
[bodies.upper]
mass = 1.0
center_of_mass = [0, 0, -0.3]
inertia = [0.02, 0.03, 0.01]
[bodies.lower]
mass = 0.7
center_of_mass = [0.1, 0, -0.2]
inertia = [0.01, 0.02, 0.015]
[joints.shoulder]
type = "revolute"
parent = "base"
child = "upper"
axis = [0, 1, 0]
initial = { position = 0.6, velocity = 0.5 }
[joints.elbow]
type = "spherical"
parent = "upper"
child = "lower"
position = [0, 0, -0.5]
initial = { velocity = [1.0, -0.4, 2.0] }
"""
_SPAN, _STEP = 0.4, 2e-3


def check_integrator(method: str, order: float, /, **parameters: Any) -> None:
    """Check a method of integration on a double pendulum with a hinge and a ball joint.

    Demands: errors fall with the order as steps are halved, against rk4 in small steps; a run in two parts by a
    checkpoint has the bits of one run; rows of the generated C, compiled alone without warnings, have the bits of a
    run.

    Parameters
    ----------
    method : str
        A name of the method, with fixed steps.
    order : float
        Order of convergence that is expected, within 0.2.
    **parameters : float
        Of the method, as for ``simulate``.

    Raises
    ------
    ContractError
        Naming the method and the demand.
    """
    scene = load_toml(_SCENE)
    model = build(scene, profile="reproducible")
    exact = model.simulate(_SPAN, 1e-4, method="rk4").v[-1]
    runs = [model.simulate(_SPAN, step, method=method, **parameters) for step in (_STEP, _STEP / 2.0)]
    for run in runs:
        demand(run.success, method, f"a run fails: {run.message}")
    errors = [float(np.abs(run.v[-1] - exact).max()) for run in runs]
    slope = float(np.log2(errors[0] / errors[1]))
    demand(abs(slope - order) <= 0.2, method, f"errors fall with order {slope:.2f}, and not {order:g}: {errors}")
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "half.ckpt"
        first = model.simulate(_SPAN / 2.0, _STEP, method=method, checkpoint=file, **parameters)
        whole = first.followed_by(model.resume(file, _SPAN))
        equal = np.array_equal(whole.q, runs[0].q) and np.array_equal(whole.v, runs[0].v)
        demand(equal, method, "a run that is resumed from a checkpoint differs from one run")
    _check_c(method, parameters)


def _check_c(method: str, parameters: dict[str, Any]) -> None:
    data = {**tomllib.loads(_SCENE), "simulation": {"method": method, "step": _STEP, **parameters}}
    scene = from_data(data)
    with tempfile.TemporaryDirectory() as name:
        program = compile_c(scene, Path(name))
        printed = subprocess.run([str(program), "0.1"], capture_output=True, text=True, check=True).stdout
    rows = np.array([line.split(",") for line in printed.splitlines()[1:]], dtype=float)
    run = build(scene, profile="reproducible").simulate(0.1)
    size = run.q.shape[1]
    equal = len(rows) == len(run.q) and np.array_equal(rows[:, 1 : 1 + size], run.q)
    demand(equal, method, "rows of the generated C differ from the rows of a run")
