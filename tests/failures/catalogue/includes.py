"""Failure catalogue: included files."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("An included file that is not there", 3, more='[include.hand]\nfile = "hand.toml"'),
    Failure("A file that includes itself", 3, more='[include.hand]\nfile = "scene.toml"'),
    Failure(
        "A mistake in an included file",
        3,
        "description error: hand.toml:8 (bodies.hand_palm.mass): unknown name 'lod' (column 1); try: log [E1553]",
        more='[include.hand]\nfile = "hand.toml"',
        files={
            "hand.toml": (
                "format = 1\n"
                'name = "hand"\n'
                "\n"
                "[parameters]\n"
                "size = 0.1\n"
                "\n"
                "[bodies.palm]\n"
                'mass = "lod"\n'
                "\n"
                "[joints.wrist]\n"
                'type = "fixed"\n'
                'parent = "base"\n'
                'child = "palm"\n'
            )
        },
    ),
    Failure(
        "A parameter that the included file has not",
        3,
        more='[include.hand]\nfile = "hand.toml"\nparameters = { sise = 0.2 }',
        files={
            "hand.toml": (
                "format = 1\n"
                'name = "hand"\n'
                "\n"
                "[parameters]\n"
                "size = 0.1\n"
                "\n"
                "[bodies.palm]\n"
                "mass = 0.1\n"
                "\n"
                "[joints.wrist]\n"
                'type = "fixed"\n'
                'parent = "base"\n'
                'child = "palm"\n'
            )
        },
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
            "[include.hand]\n"
            'file = "hand.toml"\n'
            "\n"
            "[bodies.hand_palm]\n"
            "mass = 1.0\n"
            "\n"
            "[joints.second]\n"
            'type = "fixed"\n'
            'parent = "upper"\n'
            'child = "hand_palm"'
        ),
        files={
            "hand.toml": (
                "format = 1\n"
                'name = "hand"\n'
                "\n"
                "[parameters]\n"
                "size = 0.1\n"
                "\n"
                "[bodies.palm]\n"
                "mass = 0.1\n"
                "\n"
                "[joints.wrist]\n"
                'type = "fixed"\n'
                'parent = "base"\n'
                'child = "palm"\n'
            )
        },
    ),
]
