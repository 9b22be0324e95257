"""Failure catalogue: names."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("C that ends a comment", 3, old='name = "arm"', new='name = "arm */ int main(void) { abort(); } /*"'),
    Failure("A body called base", 3, more="[bodies.base]\nmass = 1.0"),
    Failure("A parameter called like the time", 3, old="length = { value = 0.5", new="t = 1.0\nlength = { value = 0.5"),
    Failure(
        "A parameter and an input of one name",
        3,
        old="length = { value = 0.5",
        new="motor = 1.0\nlength = { value = 0.5",
    ),
]
