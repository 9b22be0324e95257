"""Failure catalogue: scene files."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("A file that is not there", 7, command="info arm.toml"),
    Failure("A folder in the place of a file", 2, command="info ."),
    Failure(
        "A file of unknown kind",
        2,
        "usage error: 'scene.txt' is not a kind of file that can be read; "
        "try: a .toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file [E1680]",
        command="info scene.txt",
        files={"scene.txt": "name: arm\n"},
    ),
    Failure("TOML that is not closed", 3, old='name = "arm"', new='name = "arm'),
    Failure(
        "A key given twice",
        3,
        "description error: scene.toml:3: this is not TOML: the key name is given twice; try: one of them [E1971]",
        old='name = "arm"',
        new='name = "arm"\nname = "leg"',
    ),
    Failure("Bytes that are no UTF-8", 3, files={"scene.toml": b'format = 1\nname = "arm\xff"\n'}),
    Failure("An empty file", 3, files={"scene.toml": ""}),
    Failure("Another version of the format", 3, old="format = 1", new="format = 2"),
    Failure("A key that there is not", 3, old='mass = "1 + load"', new='mas = "1 + load"'),
    Failure(
        "A section that there is not",
        3,
        "description error: scene.toml:33 (body): the key 'body' is unknown here; try: bodies [E0722]",
        more="[body.lower]\nmass = 1.0",
    ),
    Failure("A word for a number that it is not", 3, old="tunable = true", new='tunable = "yes"'),
    Failure(
        "A vector of two numbers",
        3,
        "description error: scene.toml:20 (joints.shoulder.axis): a list of 3 entries is needed here, not 2; try:"
        " axis = [0, 0, 1] [E1475]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1]",
    ),
    Failure("An axis without a direction", 3, old="axis = [0, 1, 0]", new="axis = [0, 0, 0]"),
    Failure(
        "A number that is none",
        3,
        "description error: scene.toml:14 (bodies.upper.inertia[1]): a finite number is needed here, not nan [E1475]",
        old="inertia = [0.03, 0.03, 0.002]",
        new="inertia = [0.03, nan, 0.002]",
    ),
]
