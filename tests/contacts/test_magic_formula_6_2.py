"""Magic Formula 6.2 next to equations in plain NumPy: vertical force, radius under a load, moments about x and y."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.optimize import brentq

from eomgen.products.contacts.tangential_laws import tangential_law
from tests.contacts.states import MORE, Array, own_tyre, results_at

LAW = tangential_law("magic_formula", "6.2")
#: Coefficients by file: the own tyre with all keys of 6.2, camber without Q_CAM1 and Q_CAM2, and no key of 6.2.
FULL = {**own_tyre().numbers, **MORE["6.2"], "FZMIN": 2500.0, "VXLOW": 2.0}
FILES: Mapping[str, Mapping[str, float]] = {
    "full": FULL,
    "without_free_camber": {**FULL, "Q_CAM1": 0.0, "Q_CAM2": 0.0},
    "of_6_1": {name: number for name, number in FULL.items() if name not in MORE["6.2"]},
}


def states() -> Array:
    """Return load, kappa, alpha, gamma, speed, pressure at 60 states, of which some are below FZMIN and VXLOW."""
    rng = np.random.default_rng(62)
    low, high = np.array([[1500.0, -0.3, -0.2, -0.08, 12.0, 1.8e5], [6500.0, 0.3, 0.2, 0.08, 30.0, 2.4e5]])
    drawn = rng.uniform(low, high, (60, 6))
    drawn[::6, 1], drawn[1::6, 1], drawn[2::6, 3] = -0.95, -1.05, 0.0
    return drawn


def vertical_force(
    p: Mapping[str, float],
    radius: float,
    free: float,
    omega: float,
    gamma: float,
    pressure: float,
    fx: float,
    fy: float,
) -> float:
    """Return the force of a wheel with a loaded and a free radius, by the manual of MF-Tyre 6.2."""
    p = {**dict.fromkeys(MORE["6.2"], 0.0), **p}
    size, tilt = abs(gamma), np.tan(abs(gamma))
    penetration = free - radius
    stretch = [r * p["Q_CAM1"] + r**2 * p["Q_CAM2"] for r in (radius, free)]
    deflection = penetration
    if stretch[1]:
        half_tread = p["WIDTH"] * (1.075 - 0.5 * p["ASPECT_RATIO"]) / 8.0
        deflection += (stretch[0] / stretch[1]) ** 2 * half_tread * tilt - p["Q_CAM3"] * penetration * size
    relative, share = deflection / p["UNLOADED_RADIUS"], radius / free
    shift = (p["Q_FYS1"] + p["Q_FYS2"] * share + p["Q_FYS3"] * share**2) * gamma
    lost_x, lost_y = p["Q_FCX"] * fx / p["FNOMIN"], p["Q_FCY"] * relative ** p["Q_FCY2"] * (fy - shift) / p["FNOMIN"]
    faster = p["Q_V2"] * abs(omega) * p["UNLOADED_RADIUS"] / p["LONGVL"]
    linear = np.sqrt((p["VERTICAL_STIFFNESS"] * p["UNLOADED_RADIUS"] / p["FNOMIN"]) ** 2 - 4.0 * p["Q_FZ2"])
    spring = p["FNOMIN"] * (linear * relative + p["Q_FZ2"] * relative**2)
    inflated = 1.0 + p["PFZ1"] * (pressure / p["NOMPRES"] - 1.0)
    return float(spring * inflated * (1.0 + faster - lost_x**2 - lost_y**2))


@pytest.mark.parametrize("file", FILES)
def test_the_loaded_radius_gives_the_load(file: str) -> None:
    p = FILES[file]
    found = results_at("6.2", p, drawn := states())
    for state, (load, kappa, _, gamma, speed, pressure) in enumerate(drawn):
        fx, fy, rolling = (float(found[name][state]) for name in ("Fx", "Fy", "Re"))
        omega = speed * (1.0 + kappa) / rolling
        free = p["UNLOADED_RADIUS"] * (p["Q_RE0"] + p["Q_V1"] * (omega * p["UNLOADED_RADIUS"] / p["LONGVL"]) ** 2)

        def over(
            radius: float, given: tuple[float, ...] = (free, omega, gamma, pressure, fx, fy), load: float = load
        ) -> float:
            return vertical_force(p, radius, *given) - load

        radius = brentq(over, free - 0.06, free - 1e-4, xtol=1e-14)
        assert found["Rl"][state] == pytest.approx(radius, rel=1e-9), state


@pytest.mark.parametrize("file", FILES)
def test_moments_about_x_and_y(file: str) -> None:
    p = FILES[file]
    found = results_at("6.2", p, drawn := states())
    load, kappa, _, gamma, speed, pressure = drawn.T
    fx, fy = found["Fx"] / p["FNOMIN"], found["Fy"] / p["FNOMIN"]
    size, share, over = np.abs(gamma), np.minimum(load / p["FZMIN"], 1.0), pressure / p["NOMPRES"]
    fz = load * share**2 / p["FNOMIN"]
    arms = p["QSX1"] - p["QSX2"] * gamma * (1.0 + p["PPMX1"] * (over - 1.0)) - p["QSX12"] * gamma * size
    arms += p["QSX3"] * fy + p["QSX10"] * np.arctan(p["QSX11"] * fz) * gamma
    arms += (
        p["QSX4"]
        * np.cos(p["QSX5"] * np.arctan((p["QSX6"] * fz) ** 2))
        * np.sin(p["QSX7"] * gamma + p["QSX8"] * np.arctan(p["QSX9"] * fy))
    )
    moment = p["UNLOADED_RADIUS"] * p["FNOMIN"]
    np.testing.assert_allclose(found["Mx"], moment * (fz * arms + fy * (p["QSX13"] + p["QSX14"] * size)), rtol=1e-11)
    fz, fast = load * share / p["FNOMIN"], speed / p["LONGVL"]
    drag = p["QSY1"] + p["QSY2"] * fx + p["QSY3"] * fast + p["QSY4"] * fast**4
    drag += (p["QSY5"] + p["QSY6"] * fz) * gamma**2
    rolling = np.sin(0.5 * np.pi * np.clip(speed * (1.0 + kappa) / p["VXLOW"], -1.0, 1.0))
    expected = -moment * drag * fz ** p["QSY7"] * over ** p["QSY8"] * rolling
    np.testing.assert_allclose(found["My"], expected, rtol=1e-9, atol=1e-12)
    assert np.any(share < 1.0) and np.any(np.abs(rolling) < 1.0) and np.any(rolling < 0.0)


def test_a_locked_wheel_has_no_rolling_moment_in_either_direction() -> None:
    """The slip is by the modulus of the forward speed, so that 1 is a locked wheel that slides backwards."""
    slip, speed = np.array([-1.0, 1.0, 0.0, 0.0]), np.array([9.0, -9.0, 9.0, -9.0])
    given = {"slip_x": slip, "velocity_x": speed, **dict.fromkeys(("slip_y", "camber"), np.zeros(4))}
    found = LAW.values(["moment_y"], FULL, load=4000.0, **given)["moment_y"]
    np.testing.assert_allclose(found[:2], 0.0, atol=1e-12)
    assert found[2] == pytest.approx(-found[3], rel=1e-12) and found[2] < -1.0


def test_a_file_without_the_keys_of_6_2_has_the_vertical_force_of_6_1() -> None:
    """Except the deflection by camber, which is 0 without Q_CAM1 and Q_CAM2."""
    known = {"load": 4000.0, "slip_x": 0.02, "slip_y": 0.05, "camber": 0.06, "velocity_x": 16.0, "wheel_speed": 52.0}
    known |= {"deflection": 0.02, "force_held_x": 300.0, "force_held_y": -900.0}
    names = ["vertical_force", "force_x", "force_y", "moment_x", "moment_y", "moment_z"]
    both = [
        tangential_law("magic_formula", version).values(names, FILES["of_6_1"], **known) for version in ("6.1", "6.2")
    ]
    for name in names:
        assert both[0][name] == pytest.approx(float(both[1][name]), rel=1e-12), name
