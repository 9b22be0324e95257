"""Failure catalogue: names."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("C that ends a comment", 3, old='name = "arm"', new='name = "arm */ int main(void) { abort(); } /*"'),
    Failure(
        "A name of 65 letters",
        3,
        "description error: scene.toml:2 (name): the name 'aaa{any}...' is not legal; try: {any} [E0715]",
        old='name = "arm"',
        new=f'name = "{65 * "a"}"',
    ),
    Failure("A body called base", 3, more="[bodies.base]\nmass = 1.0"),
    Failure("A parameter called like the time", 3, old="length = { value = 0.5", new="t = 1.0\nlength = { value = 0.5"),
    Failure(
        "A parameter and an input of one name",
        3,
        old="length = { value = 0.5",
        new="motor = 1.0\nlength = { value = 0.5",
    ),
    Failure(
        "A name in quotes with a blank",
        3,
        "description error: 2 problems\n  1. scene.toml:22 (points.'the tip'): the name 'the tip' is not legal; try: up"
        " to 64 ASCII letters, digits and underscores, no digit first [E0715]\n  2. scene.toml:31"
        " (outputs.tip.position): there"
        " is no point 'tip'; try: a [points] section [E0100]",
        old="[points.tip]",
        new='[points."the tip"]',
    ),
]
