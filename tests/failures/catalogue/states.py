"""Failure catalogue: internal states."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A state without its rate", 3,
        "description error: scene.toml:34 (states.lag.rate): the key rate is missing; try: rate = ...",
        more=(
            "[states]\n"
            "lag = { initial = 1.0 }"
        ),
    ),
    Failure(
        "A state in a mass", 3,
        (
            "description error: scene.toml:12 (bodies.upper.mass): the state 'lag' cannot be used here (column 5); try: "
            "parameters only"
        ),
        old='mass = "1 + load"',
        new='mass = "1 + lag"',
        more=(
            "[states]\n"
            'lag = { rate = "-lag" }'
        ),
    ),
    Failure(
        "A state called like a parameter", 3,
        (
            "description error: scene.toml:34 (states.load): the name load is both a parameter and a state; try: another "
            "name for one of them"
        ),
        more=(
            "[states]\n"
            'load = { rate = "-load" }'
        ),
    ),
    Failure(
        "A rate with a name that there is not", 3,
        "description error: scene.toml:34 (states.lag.rate): unknown name 'motr' (column 1); try: motor",
        more=(
            "[states]\n"
            'lag = { rate = "motr - lag" }'
        ),
    ),
]  # fmt: skip
