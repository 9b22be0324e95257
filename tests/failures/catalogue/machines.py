"""Failure catalogue: machines."""

from __future__ import annotations

from tests.failures.failure import Failure

_LOWER = """\
[bodies.lower]
mass = 1.0
inertia = [1, 1, 1]

[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
axis = [0, 1, 0]"""

FAILURES = [
    Failure("A negative mass", 3, old='mass = "1 + load"', new="mass = -1.0"),
    Failure(
        "Moments of inertia that no body has",
        3,
        old="inertia = [0.03, 0.03, 0.002]",
        new="inertia = [0.03, 0.01, 0.002]",
    ),
    Failure("A type of joint that there is not", 3, old='type = "revolute"', new='type = "hinge"'),
    Failure("A parent that there is not", 3, old='parent = "base"', new='parent = "bse"'),
    Failure("A body that hangs on nothing", 3, more="[bodies.lower]\nmass = 1.0"),
    Failure(
        "A body that two joints carry",
        3,
        more='[joints.second]\ntype = "revolute"\nparent = "base"\nchild = "upper"\naxis = [0, 0, 1]',
    ),
    Failure("Joints in a circle", 3, old='parent = "base"', new='parent = "lower"', more=_LOWER),
    Failure(
        "A joint that moves nothing that resists",
        3,
        old='mass = "1 + load"\ncenter_of_mass = [0, 0, "-length / 2"]\ninertia = [0.03, 0.03, 0.002]',
        new="mass = 0",
    ),
    Failure(
        "A quaternion that is not of unit length",
        3,
        more=(
            '[bodies.ball]\nmass = 1.0\ninertia = [1, 1, 1]\n\n[joints.ball]\ntype = "spherical"\n'
            'parent = "upper"\nchild = "ball"\ninitial = { position = [1, 1, 0, 0] }'
        ),
    ),
    Failure(
        "A spring between points that never part",
        4,
        more=(
            '[points.twin]\nbody = "upper"\nposition = [0, 0, "-length"]\n\n'
            '[springs.coil]\nfirst = "tip"\nsecond = "twin"\nstiffness = 10'
        ),
    ),
    Failure(
        "An output of a point that there is not", 3, old='tip = { position = "tip" }', new='tip = { position = "top" }'
    ),
    Failure(
        "An output of two kinds at once",
        3,
        old='tip = { position = "tip" }',
        new='tip = { position = "tip", velocity = "tip" }',
    ),
    Failure(
        "A constraint within one body",
        3,
        more='[constraints.rod]\ntype = "distance"\nfirst = "tip"\nsecond = { body = "upper" }\nlength = 0.5',
    ),
    Failure(
        "Constraints that contradict each other",
        4,
        "model error: scene.toml:37 (constraints.rod): the positions of the constraints cannot be met together: after "
        "50 corrections still off: rod: distance by 2; rod has length = 0.5 m; try: an initial state nearer to"
        " assembly, or lengths and axes that fit; numbers without a unit are in m and in rad [E2082]",
        more=(
            '[points.wall]\nbody = "world"\nposition = [0, 0, 2]\n\n[constraints.rod]\n'
            'type = "distance"\nfirst = "tip"\nsecond = "wall"\nlength = 0.5'
        ),
    ),
    Failure("A scene without a moving joint", 3, old='type = "revolute"', new='type = "fixed"'),
    Failure(
        "A method that there is not", 3, command="simulate scene.toml --out out", more='[simulation]\nmethod = "newmrk"'
    ),
    Failure("A helical joint without its pitch", 3, old='type = "revolute"', new='type = "helical"'),
    Failure(
        "A stop below the other",
        3,
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\nlimits = { lower = 1.0, upper = -1.0, stiffness = 500 }",
    ),
    Failure(
        "A stop without stiffness",
        3,
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\nlimits = { lower = -1.0, upper = 1.0 }",
    ),
    Failure("A tyre without a radius", 3, more='[tyres.wheel]\ncenter = "tip"\nradius = 0\nstiffness = 2e5'),
    Failure("A joint that follows itself", 3, more=_LOWER + '\nmimic = { joint = "elbow" }'),
    Failure(
        "A drive that jumps at times that are not known, smoothed",
        3,
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\ndrive = "0.2 * sign(sin(t))"\nsmooth = "10 ms"',
    ),
    Failure("Nothing to smooth", 3, old="axis = [0, 1, 0]", new='axis = [0, 1, 0]\nsmooth = "10 ms"'),
    Failure("An input as a drive", 3, old="axis = [0, 1, 0]", new='axis = [0, 1, 0]\ndrive = "motor"'),
]
