"""Failure catalogue: scene files."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A file that is not there",
        7,
        "input/output error: 'arm.toml': cannot be read: No such file or directory; try: another path [E0115]",
        command="info arm.toml",
    ),
    Failure(
        "A folder in the place of a file",
        2,
        "usage error: '.' is not a kind of file that can be read; "
        "try: a .toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file [E1680]",
        command="info .",
    ),
    Failure(
        "A file of unknown kind",
        2,
        "usage error: 'scene.txt' is not a kind of file that can be read; "
        "try: a .toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file [E1680]",
        command="info scene.txt",
        files={"scene.txt": "name: arm\n"},
    ),
    Failure(
        "TOML that is not closed",
        3,
        "description error: scene.toml:2: this is not TOML: Illegal character '\\n' (column 12); try: TOML syntax: key"
        " = value, texts in quotes [E1971]",
        old='name = "arm"',
        new='name = "arm',
    ),
    Failure(
        "A key given twice",
        3,
        "description error: scene.toml:3: this is not TOML: the key name is given twice; try: one of them [E1971]",
        old='name = "arm"',
        new='name = "arm"\nname = "leg"',
    ),
    Failure(
        "Bytes that are no UTF-8",
        3,
        "description error: scene.toml:2: byte 22 is not UTF-8; try: the file saved as UTF-8 [E1894]",
        files={"scene.toml": b'format = 1\nname = "arm\xff"\n'},
    ),
    Failure(
        "An empty file",
        3,
        'description error: scene.toml: the scene is empty; try: format = 1, name = "...", and [bodies] and'
        " [joints] [E1681]",
        files={"scene.toml": ""},
    ),
    Failure(
        "Another version of the format",
        3,
        "description error: scene.toml:1 (format): this eomgen reads format 1, not 2;"
        " try: format = 1, or a newer eomgen [E1479]",
        old="format = 1",
        new="format = 2",
    ),
    Failure(
        "A key that there is not",
        3,
        "description error: scene.toml:12 (bodies.upper.mas): the key 'mas' is unknown here; try: mass [E0722]",
        old='mass = "1 + load"',
        new='mas = "1 + load"',
    ),
    Failure(
        "A section that there is not",
        3,
        "description error: scene.toml:33 (body): the key 'body' is unknown here; try: bodies [E0722]",
        more="[body.lower]\nmass = 1.0",
    ),
    Failure(
        "A word for a number that it is not",
        3,
        "description error: scene.toml:6 (parameters.load.tunable): true or false is needed here, not 'yes'; try: "
        "tunable = true [E1475]",
        old="tunable = true",
        new='tunable = "yes"',
    ),
    Failure(
        "A vector of two numbers",
        3,
        "description error: scene.toml:20 (joints.shoulder.axis): a list of 3 entries is needed here, not 2; try:"
        " axis = [0, 0, 1] [E1475]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1]",
    ),
    Failure(
        "An axis without a direction",
        3,
        "description error: scene.toml:20 (joints.shoulder.axis): the axis has no direction; try: an axis such as [0,"
        " 0, 1] [E1838]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 0, 0]",
    ),
    Failure(
        "A number that is none",
        3,
        "description error: scene.toml:14 (bodies.upper.inertia[1]): a finite number is needed here, not nan [E1475]",
        old="inertia = [0.03, 0.03, 0.002]",
        new="inertia = [0.03, nan, 0.002]",
    ),
]
