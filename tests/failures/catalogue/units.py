"""Failure catalogue: units."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("A length in the place of a mass", 3, old='mass = "1 + load"', new='mass = "250 mm"'),
    Failure("A unit that there is not", 3, old='mass = "1 + load"', new='mass = "2 kilogramm"'),
    Failure(
        "A unit within a formula",
        3,
        old='center_of_mass = [0, 0, "-length / 2"]',
        new='center_of_mass = [0, 0, "-length / 2 mm"]',
    ),
    Failure(
        "A frequency in the place of an angular speed",
        3,
        "description error: scene.toml:21 (joints.shoulder.initial.velocity): '50 Hz' is a frequency, an angular"
        ' speed in rad/s is expected; try: "3000 rpm" where a cycle is a turn, or "50 rad/s" [E0303]',
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\ninitial = { velocity = "50 Hz" }',
    ),
    Failure(
        "A frequency in the place of a time",
        3,
        "description error: scene.toml:36 (controllers.servo.time_constant): '20 Hz' is a frequency, a time in s is"
        ' expected; try: a time in s: the period, "0.05 s", or 1 / (2 pi f) where f is the corner frequency of a'
        " filter [E0303]",
        more='[controllers.servo]\ntype = "low_pass"\nsignal = "q.shoulder"\ntime_constant = "20 Hz"',
    ),
    Failure(
        "A gain with a unit",
        3,
        more='[controllers.servo]\ntype = "pi"\nsignal = "q.shoulder"\nproportional = "2 kN m/rad"',
    ),
    Failure(
        "A unit that can be read in two ways", 3, old="axis = [0, 1, 0]", new='axis = [0, 1, 0]\nstiffness = "3 N/m s"'
    ),
    Failure(
        "Degrees Celsius",
        3,
        old='load = { value = 1.0, unit = "kg", tunable = true }',
        new='load = { value = "20 degC", tunable = true }',
    ),
    Failure(
        "Another dimension for a parameter of a run",
        2,
        "usage error: --set load=3mm: '3mm' is a length, a mass in kg is expected; try: \"0.003 kg\" [E0303]",
        command="simulate scene.toml --out out --set load=3mm",
    ),
]
