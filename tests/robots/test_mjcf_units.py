"""MJCF: forces of one machine whose file is written in other units are the same, and MuJoCo's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from eomgen.products.studies.ladders.scaling import SceneUnits
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.mjcf_oracle import Imported

STATES = 4
UNITS = [SceneUnits(**{name: size}) for name in ("mass", "time") for size in (1e-6, 1e6)]
# MuJoCo takes no inertia below 1e-15 kg m^2, and no square of a length of a box below 1e-15 kg m^2 over its mass
UNITS += [SceneUnits(length=1e-6, mass=1e12), SceneUnits(length=1e6, mass=1e-12)]


def machine(units: SceneUnits) -> str:
    """Return an arm with a slide and a ball in a medium, with a rope and three drives."""

    def of(unit: str, *values: float) -> str:
        return " ".join(repr(value * units.size(unit)) for value in values)

    return f"""<mujoco><option gravity="{of("m/s^2", 0.3, 0, -9.81)}" density="{of("kg/m^3", 1.2)}"
      viscosity="{of("Pa*s", 0.02)}" wind="{of("m/s", 1, -2, 0.5)}"/>
    <worldbody><site name="wall" pos="{of("m", 1, 0, 0.5)}"/>
    <body gravcomp="0.4"><joint name="hinge" axis="0 1 0" stiffness="{of("N*m", 3)}" damping="{of("N*m*s", 0.4)}"
      armature="{of("kg*m^2", 0.02)}"/>
      <inertial pos="{of("m", 0.2, 0, 0.01)}" mass="{of("kg", 1)}" diaginertia="{of("kg*m^2", 0.01, 0.02, 0.025)}"/>
      <geom type="ellipsoid" size="{of("m", 0.25, 0.1, 0.05)}" mass="0" fluidshape="ellipsoid"
        fluidcoef="0.5 0.25 1.5 1 1"/>
      <body pos="{of("m", 0.5, 0, 0)}"><joint name="rail" type="slide" axis="1 0 0" stiffness="{of("N/m", 20)}"
        damping="{of("N*s/m", 0.7)}"/><site name="eye" pos="{of("m", 0, 0, 0.1)}"/>
        <inertial pos="{of("m", 0.05, 0.02, 0)}" mass="{of("kg", 0.5)}" diaginertia="{of("kg*m^2", 2e-3, 2e-3, 3e-3)}"/>
        <body pos="{of("m", 0.1, 0, 0)}"><joint type="ball" damping="{of("N*m*s", 0.01)}"/>
          <inertial pos="{of("m", 0, 0.03, 0)}" mass="{of("kg", 0.3)}"
            diaginertia="{of("kg*m^2", 1e-3, 1.5e-3, 2e-3)}"/>
    </body></body></body></worldbody>
    <tendon><spatial name="rope" stiffness="{of("N/m", 30)}" damping="{of("N*s/m", 0.2)}" springlength="{of("m", 0.4)}">
      <site site="wall"/><site site="eye"/></spatial></tendon>
    <actuator><motor joint="hinge" gear="2"/><position joint="rail" kp="{of("N/m", 40)}" kv="{of("N*s/m", 0.5)}"/>
      <general tendon="rope" dyntype="filter" dynprm="{of("s", 0.1)}" gainprm="{of("N", 3)}" biastype="affine"
        biasprm="{of("N", 0.1)} {of("N/m", -2)} {of("N*s/m", -0.3)}"/></actuator></mujoco>"""


def forces(units: SceneUnits, file: Path) -> NDArray[np.float64]:
    """Return the forces at some states of the machine in SI units, (n, 5)."""
    file.write_text(machine(units), encoding="utf-8")
    system, rng = Imported.of(file).system, np.random.default_rng(4)
    q, v = rng.normal(size=(STATES, 6)), rng.normal(size=(STATES, 5))
    q[:, 1] *= 0.1 * units.size("m")
    q[:, 2:] /= np.linalg.norm(q[:, 2:], axis=1, keepdims=True)
    v *= [units.size("m/s" if k == 1 else "1/s") for k in range(5)]
    u = rng.normal(size=(STATES, 3)) * [units.size("N*m"), 0.1 * units.size("m"), 1.0]
    zero = {"t": np.zeros(STATES), "a": np.zeros((STATES, 5)), "lam": np.zeros((STATES, 0))}
    found = tape_evaluator(system)("residual", {"q": q, "v": v, "u": u, "z": rng.normal(size=(STATES, 1)), **zero})["r"]
    result: NDArray[np.float64] = found[:, :5] / [units.size("N" if k == 1 else "N*m") for k in range(5)]
    return result


@pytest.mark.slow
@pytest.mark.parametrize("units", UNITS, ids=str)
def test_forces_do_not_depend_on_units(units: SceneUnits, tmp_path: Path) -> None:
    expected = forces(SceneUnits(), tmp_path / "a.xml")
    np.testing.assert_allclose(forces(units, tmp_path / "b.xml"), expected, rtol=1e-9)
