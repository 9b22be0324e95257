"""Results of the Magic Formula at states as MFeval takes them: load, slip, slip angle, camber, speed, pressure.

MFeval finds the speed of the wheel from the forward speed and the slip, and from the load the deflection.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from eomgen.products.contacts.tangential_laws import TangentialLaw, read_formulas, tangential_law
from eomgen.products.contacts.tyre_files import TyreFile, read_tyre_file

Array = NDArray[np.float64]
OWN = Path(__file__).with_name("car_tyre.tir")
#: Names of results by MFeval's names.
RESULTS = {
    "Fx": "force_x", "Fy": "force_y", "Mx": "moment_x", "My": "moment_y", "Mz": "moment_z",
    "Re": "effective_radius", "rho": "static_deflection", "Rl": "loaded_radius", "two_a": "contact_length",
    "t": "trail", "mux": "friction_x", "muy": "friction_y", "Kya": "stiffness_y", "Kxk": "stiffness_x",
    "sigmax": "relaxation_x", "sigmay": "relaxation_y",
}  # fmt: skip  # a table
#: Coefficients that versions other than 6.1 have in addition.
MORE: Mapping[str, Mapping[str, float]] = {
    "5.2": {"PHY3": 0.02, "PTX1": 1.2, "PTX2": 0.1, "PTX3": -0.3, "PTY1": 1.5, "PTY2": 2.5, "Q_FZ2": 1e-4},
    "6.1": {},
    "6.2": {
        "Q_CAM1": 0.6, "Q_CAM2": 1.2, "Q_CAM3": 0.3, "Q_FCY2": -0.3, "Q_FYS1": -400.0, "Q_FYS2": 500.0, "Q_FYS3": 200.0
    },
}  # fmt: skip  # a table
#: Formulas of mode 221 of MFeval in place of those of mode 211: tangents and sines in the equations of the book alone.
_MODE_221 = {"alpha": "slip_y", "gamma": "sin(camber)", "cos_slip": "cos(slip_y)"}


def own_tyre() -> TyreFile:
    """Return a tyre of round numbers."""
    return read_tyre_file(OWN)


def results_at(version: str, numbers: Mapping[str, float], states: Array, mode: str = "211") -> dict[str, Array]:
    """Return results by MFeval's names at states (n, 6): load, kappa, alpha, gamma, forward speed, pressure (0: of the
    file)."""
    law = tangential_law("magic_formula", version)
    if mode == "221":
        other = read_formulas(_MODE_221, ["slip_y", "camber"], []).formulas
        law = TangentialLaw({**law.formulas, **other}, law.quantities)
    load, kappa, alpha, gamma, speed, pressure = states.T
    known = {**numbers, **({"INFLPRES": pressure} if pressure.any() else {}), "CURVATURE_MOST": 1e3}  # 2xx: no limits
    given = {"load": load, "slip_x": kappa, "slip_y": np.tan(alpha), "camber": gamma, "velocity_x": speed}
    given["wheel_speed"] = speed / numbers["UNLOADED_RADIUS"]
    for _ in range(60):
        radius = law.values(["effective_radius"], known, **given)["effective_radius"]
        given["wheel_speed"] = speed * (1.0 + kappa) / radius
    if version == "6.2":
        forces = law.values(["force_x", "force_y"], known, **given)
        given |= {"force_held_x": forces["force_x"], "force_held_y": forces["force_y"]}
        given["deflection"] = deflection_under(law, known, given)
    found = law.values([*RESULTS.values()], known, **given)
    return {name: np.broadcast_to(found[result], load.shape) for name, result in RESULTS.items()}


def deflection_under(law: TangentialLaw, known: Mapping[str, float | Array], given: Mapping[str, Array]) -> Array:
    """Return the deflection at which the vertical force is the load, by Newton's method with differences."""
    deflection, step = np.full_like(given["load"], 0.01), 1e-7

    def force(deflection: Array) -> Array:
        return law.values(["vertical_force"], known, **given, deflection=deflection)["vertical_force"]

    for _ in range(50):
        slope = (force(deflection + step) - force(deflection - step)) / (2.0 * step)
        deflection = deflection - (force(deflection) - given["load"]) / slope
    return deflection
