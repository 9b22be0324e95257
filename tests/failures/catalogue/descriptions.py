"""Failure catalogue: scene files."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("A file that is not there", 7, command="info arm.toml"),
    Failure("A folder in the place of a file", 2, command="info ."),
    Failure("TOML that is not closed", 3, old='name = "arm"', new='name = "arm'),
    Failure("Bytes that are no UTF-8", 3, files={"scene.toml": b'format = 1\nname = "arm\xff"\n'}),
    Failure("An empty file", 3, files={"scene.toml": ""}),
    Failure("Another version of the format", 3, old="format = 1", new="format = 2"),
    Failure("A key that there is not", 3, old='mass = "1 + load"', new='mas = "1 + load"'),
    Failure("A word for a number that it is not", 3, old="tunable = true", new='tunable = "yes"'),
    Failure("An axis without a direction", 3, old="axis = [0, 1, 0]", new="axis = [0, 0, 0]"),
]
