"""Failure catalogue: included files."""

from __future__ import annotations

from tests.failures.failure import Failure

_HAND = """\
format = 1
name = "hand"

[parameters]
size = 0.1

[bodies.palm]
mass = 0.1

[joints.wrist]
type = "fixed"
parent = "base"
child = "palm"
"""

FAILURES = [
    Failure("An included file that is not there", 3, more='[include.hand]\nfile = "hand.toml"'),
    Failure("A file that includes itself", 3, more='[include.hand]\nfile = "scene.toml"'),
    Failure(
        "A parameter that the included file has not",
        3,
        more='[include.hand]\nfile = "hand.toml"\nparameters = { sise = 0.2 }',
        files={"hand.toml": _HAND},
    ),
    Failure(
        "A name that two files give",
        3,
        "description error: 2 problems\n"
        "  1. hand.toml:13 (joints.hand_wrist.child): the body hand_palm is already carried by the joint second; try: "
        "one joint for each body, and [constraints] for loop closures [E1671]\n"
        "  2. scene.toml:33 (include.hand): the name hand_palm in bodies is given twice, at scene.toml:36 and at "
        'hand.toml:7; try: another prefix than "hand_" [E1597]',
        more=(
            '[include.hand]\nfile = "hand.toml"\n\n[bodies.hand_palm]\nmass = 1.0\n\n'
            '[joints.second]\ntype = "fixed"\nparent = "upper"\nchild = "hand_palm"'
        ),
        files={"hand.toml": _HAND},
    ),
]
