"""Failure catalogue: units."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A length in the place of a mass",
        3,
        "description error: scene.toml:12 (bodies.upper.mass): '250 mm' is a length, a mass in kg is expected; try: "
        '"0.25 kg" [E0303]',
        old='mass = "1 + load"',
        new='mass = "250 mm"',
    ),
    Failure(
        "A unit that there is not",
        3,
        "description error: scene.toml:12 (bodies.upper.mass): there is no unit 'kilogramm'; try: kilogram or"
        " kilograms [E0317]",
        old='mass = "1 + load"',
        new='mass = "2 kilogramm"',
    ),
    Failure(
        "A unit within a formula",
        3,
        "description error: scene.toml:13 (bodies.upper.center_of_mass[2]): '2 mm' is within a formula, where units are"
        ' not read (column 11); try: a parameter, name = "2 mm", and its name here [E1581]',
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
        "description error: scene.toml:36 (controllers.servo.proportional): '2 kN m/rad' has a unit, and a number"
        " without one is needed here; try: 2000, which it is in N m/rad [E0321]",
        more='[controllers.servo]\ntype = "pi"\nsignal = "q.shoulder"\nproportional = "2 kN m/rad"',
    ),
    Failure(
        "A unit that can be read in two ways",
        3,
        "description error: scene.toml:21 (joints.shoulder.stiffness): '3 N/m s' can be read in two ways; try:"
        " brackets, N/(m s), or the divisor last, N s/m [E0312]",
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\nstiffness = "3 N/m s"',
    ),
    Failure(
        "Degrees Celsius",
        3,
        "description error: scene.toml:6 (parameters.load.value): 'degC' is not accepted as a unit: a temperature with"
        " its own zero cannot be multiplied; try: a number of K [E0316]",
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
