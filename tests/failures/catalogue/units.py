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
]
