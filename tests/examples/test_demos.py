"""The demos of examples, as users run them: what they print, and the files that they write."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.examples.demos import run_demo

#: Demo with its options, what it says, and files besides its figure.
DEMOS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "active_vehicle": (
        (
            "mass   m/s²        1.149    0.640   -44.3%",
            "rear left        mm           15.2",
            "no wheel leaves",
        ),
        ("c/active_vehicle.c", "rms.csv", "passive.npz", "active.npz"),
    ),
    "driving_car": (
        (
            "yaw rate, deg/s             10.6",
            "understeer gradient 0.10",
            "lane change: 0.05 m",
            "braking with control 1: 5",
            "vertical: 1.02",
        ),
        ("step_steer.png", "ramp_steer.png", "sine_with_dwell.png", "split_braking.png", "rough_road.png"),
    ),
    "duffing_random_excitation --samples 2000": (
        # a million samples have the mean 0.4999 and the standard deviation 0.5333 (dossier, 4.6)
        ("21 modes capture 99.99", "mean 0.501 m, standard deviation 0.531 m"),
        (),
    ),
    "frame_in_earthquake --samples 400": (("first passage of 60 mm",), ()),
    "identified_arm": (("24 of 24 unknowns determined", "s of processor time"), ()),
    "identified_quarter_car": (("5 of 5 unknowns determined", "spring / tyre = 0.09"), ()),
    "moored_platform": (("elevation 0.922 m, deck 0.167 m", "the load swings up to 43.6 degrees"), ()),
    "quarter_car_on_random_road --samples 400": (("with stops",), ()),
    "radar_image_of_a_swell --seas 4 --pixel 50": (("from space: velocity 0.353 m/s, cut-off 133.0 m",), ()),
    "scalar_wave": (
        ("0.386            0.105           0.0265          0.00663          0.00166", "0.271           0.0818"),
        ("c/pulse.h", "pulse.csv", "shock.csv"),
    ),
    "shear_frame_with_pendulum": (
        ("5.6e-02     1.8e-02     4.6e-03     1.1e-03     2.9e-04", "     ".join(["stopped"] * 6)),
        ("errors.csv", "weak.npz", "strong.npz"),
    ),
    "spin_up_beam": (
        ("set B                                   -0.53447", "ran away"),
        ("c/spin_up_beam.c", "peaks.csv", "with_stretch.npz"),
    ),
}


@pytest.mark.long_except("identified_quarter_car")
@pytest.mark.slow
@pytest.mark.parametrize("demo", DEMOS)
def test_demos_print_and_draw(demo: str, tmp_path: Path) -> None:
    name, *options = demo.split()
    said = run_demo(name, *options, "--out", tmp_path)
    texts, files = DEMOS[demo]
    assert all(text in said for text in texts), said
    assert all((tmp_path / file).stat().st_size > 300 for file in files)
    assert (tmp_path / f"{name}.png").stat().st_size > 20_000
