"""Failure catalogue: machines."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A negative mass",
        3,
        "description error: scene.toml:12 (bodies.upper.mass): the mass -1 is negative; try: a positive number of"
        " kg [E1709]",
        old='mass = "1 + load"',
        new="mass = -1.0",
    ),
    Failure(
        "Moments of inertia that no body has",
        3,
        "description error: scene.toml:14 (bodies.upper.inertia): the principal moments 0.002, 0.01, 0.03 violate the"
        " triangle inequality: the largest exceeds the sum of the other two; try: the values of upper about its centre"
        " of mass, in its own axes, or check_inertia = false if these are meant [E1786]",
        old="inertia = [0.03, 0.03, 0.002]",
        new="inertia = [0.03, 0.01, 0.002]",
    ),
    Failure(
        "A mass that a tunable parameter makes negative",
        3,
        "description error: scene.toml:12 (bodies.upper.mass): the mass -1 is negative; try: a positive number of"
        " kg [E1709]",
        old='mass = "1 + load"',
        new='mass = "load - 2"',
    ),
    Failure(
        "A type of joint that there is not",
        3,
        "description error: scene.toml:17 (joints.shoulder.type): 'hinge' is not known here; try: revolute [E0263]",
        old='type = "revolute"',
        new='type = "hinge"',
    ),
    Failure(
        "A parent that there is not",
        3,
        "description error: scene.toml:18 (joints.shoulder.parent): there is no body 'bse'; try: base [E1587]",
        old='parent = "base"',
        new='parent = "bse"',
    ),
    Failure(
        "A body that hangs on nothing",
        3,
        "description error: scene.toml:33 (bodies.lower): no joint carries the body lower; try: a joint with child = "
        '"lower" [E1674]',
        more="[bodies.lower]\nmass = 1.0",
    ),
    Failure(
        "A body that two joints carry",
        3,
        "description error: scene.toml:36 (joints.second.child): the body upper is already carried by the joint "
        "shoulder; try: one joint for each body, and [constraints] for loop closures [E1671]",
        more='[joints.second]\ntype = "revolute"\nparent = "base"\nchild = "upper"\naxis = [0, 0, 1]',
    ),
    Failure(
        "Joints in a circle",
        3,
        "description error: scene.toml:16 (joints.shoulder): the joints carry the bodies lower, upper in a circle; try:"
        " base as the parent of one of them [E1673]",
        old='parent = "base"',
        new='parent = "lower"',
        more=(
            "[bodies.lower]\n"
            "mass = 1.0\n"
            "inertia = [1, 1, 1]\n"
            "\n"
            "[joints.elbow]\n"
            'type = "revolute"\n'
            'parent = "upper"\n'
            'child = "lower"\n'
            "axis = [0, 1, 0]"
        ),
    ),
    Failure(
        "A joint that moves nothing that resists",
        3,
        "description error: scene.toml:14 (joints.shoulder): the joint shoulder cannot be moved by a force: it carries "
        "neither mass nor inertia, so the inertia matrix would be singular; try: mass or inertia for the body upper, "
        "rotor_inertia, or a fixed joint (of other formats: lock) [E1642]",
        old='mass = "1 + load"\ncenter_of_mass = [0, 0, "-length / 2"]\ninertia = [0.03, 0.03, 0.002]',
        new="mass = 0",
    ),
    Failure(
        "A quaternion that is not of unit length",
        3,
        "description error: scene.toml:41 (joints.ball.initial.position): the quaternion has norm 1.41421, not 1; try: "
        "[0.707106781, 0.707106781, 0, 0] [E1667]",
        more=(
            "[bodies.ball]\n"
            "mass = 1.0\n"
            "inertia = [1, 1, 1]\n"
            "\n"
            "[joints.ball]\n"
            'type = "spherical"\n'
            'parent = "upper"\n'
            'child = "ball"\n'
            "initial = { position = [1, 1, 0, 0] }"
        ),
    ),
    Failure(
        "A spring between points that never part",
        4,
        "model error: spring coil: the points tip and twin coincide for all coordinates, so it has no direction; "
        "try: points that can separate, or a torsion spring [E0501]",
        more=(
            "[points.twin]\n"
            'body = "upper"\n'
            'position = [0, 0, "-length"]\n'
            "\n"
            "[springs.coil]\n"
            'first = "tip"\n'
            'second = "twin"\n'
            "stiffness = 10"
        ),
    ),
    Failure(
        "An output of a point that there is not",
        3,
        "description error: scene.toml:31 (outputs.tip.position): there is no point 'top'; try: tip [E0100]",
        old='tip = { position = "tip" }',
        new='tip = { position = "top" }',
    ),
    Failure(
        "An output of two kinds at once",
        3,
        "description error: scene.toml:31 (outputs.tip): an output needs one of position, velocity, acceleration, "
        "reaction_force, reaction_moment, section_force, section_moment, section_strain, section_curvature, formula,"
        ' energy, not position and velocity; try: position = "tip" [E1880]',
        old='tip = { position = "tip" }',
        new='tip = { position = "tip", velocity = "tip" }',
    ),
    Failure(
        "A constraint within one body",
        3,
        "description error: scene.toml:36 (constraints.rod.second): both frames are in the same rigid body: upper; try:"
        " frames in two bodies that move against each other [E1639]",
        more='[constraints.rod]\ntype = "distance"\nfirst = "tip"\nsecond = { body = "upper" }\nlength = 0.5',
    ),
    Failure(
        "Constraints that contradict each other",
        4,
        "model error: scene.toml:37 (constraints.rod): the positions of the constraints cannot be met together: after "
        "50 corrections still off: rod: distance by 2; rod has length = 0.5 m; try: an initial state nearer to"
        " assembly, or lengths and axes that fit; numbers without a unit are in m and in rad [E2082]",
        more=(
            "[points.wall]\n"
            'body = "world"\n'
            "position = [0, 0, 2]\n"
            "\n"
            "[constraints.rod]\n"
            'type = "distance"\n'
            'first = "tip"\n'
            'second = "wall"\n'
            "length = 0.5"
        ),
    ),
    Failure(
        "Several mistakes at once",
        3,
        "description error: 3 problems\n"
        "  1. scene.toml:12 (bodies.upper.mass): unknown name 'lod' (column 5); try: load or log [E1553]\n"
        "  2. scene.toml:34 (points.hand.body): there is no body 'lower'; try: one of base, world, upper [E0100]\n"
        "  3. scene.toml:37 (outputs.hand.position): there is no point 'hnd'; try: hand [E0100]",
        old='mass = "1 + load"',
        new='mass = "1 + lod"',
        more='[points.hand]\nbody = "lower"\n\n[outputs.hand]\nposition = "hnd"',
    ),
    Failure(
        "A scene without a moving joint",
        3,
        "description error: 3 problems\n"
        "  1. scene.toml:16 (joints): no joint can move; try: a revolute, prismatic, spherical or free joint [E1640]\n"
        "  2. scene.toml:20 (joints.shoulder.axis): a fixed joint has no axis; try: rotation, for its placement"
        " [E1653]\n"
        "  3. scene.toml:26 (efforts.motor.index): the fixed joint shoulder has no component 0; try: a moving"
        " joint [E1501]",
        old='type = "revolute"',
        new='type = "fixed"',
    ),
    Failure(
        "A method that there is not",
        3,
        "description error: scene.toml:34 (simulation.method): there is no method 'newmrk'; try: newmark or "
        "newmark_index3 [E0348]",
        command="simulate scene.toml --out out",
        more='[simulation]\nmethod = "newmrk"',
    ),
    Failure(
        "A helical joint without its pitch",
        3,
        "description error: scene.toml:16 (joints.shoulder): the type helical needs the key pitch; try: pitch = 0.01"
        " [E1418]",
        old='type = "revolute"',
        new='type = "helical"',
    ),
    Failure(
        "A stop below the other",
        3,
        "description error: scene.toml:21 (joints.shoulder.limits): the lower limit 1 rad is not below the upper one,"
        " -1 rad; try: lower below upper [E1784]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\nlimits = { lower = 1.0, upper = -1.0, stiffness = 500 }",
    ),
    Failure(
        "A stop without stiffness",
        3,
        "description error: scene.toml:21 (joints.shoulder.limits.stiffness): the key stiffness is missing; try: "
        "stiffness = 1e5 [E1343]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\nlimits = { lower = -1.0, upper = 1.0 }",
    ),
    Failure(
        "Friction without the speed that makes it smooth",
        3,
        "description error: scene.toml:21 (joints.shoulder.friction.velocity): the key velocity is missing; try: "
        "velocity = 0.01 [E1343]",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\nfriction = { coulomb = 0.3 }",
    ),
    Failure(
        "A tyre about a point that there is not",
        3,
        "description error: scene.toml:34 (tyres.wheel.center): there is no point 'hub'; try: one of tip [E0100]",
        more='[tyres.wheel]\ncenter = "hub"\nradius = 0.3\nstiffness = 2e5',
    ),
    Failure(
        "A tyre without a radius",
        3,
        "description error: scene.toml:35 (tyres.wheel.radius): the radius of a tyre is 0; try: a number above"
        " 0 [E1740]",
        more='[tyres.wheel]\ncenter = "tip"\nradius = 0\nstiffness = 2e5',
    ),
    Failure(
        "A bushing within one body",
        3,
        "description error: scene.toml:35 (bushings.mount.second): both frames are in the same rigid body: upper; try: "
        "frames in two bodies that move against each other [E1639]",
        more='[bushings.mount]\nfirst = "tip"\nsecond = { body = "upper" }\nstiffness = [1e5, 1e5, 1e5]',
    ),
    Failure(
        "A joint that follows itself",
        3,
        "description error: scene.toml:42 (joints.elbow.mimic.joint): the joint elbow follows itself; try: one joint "
        "that leads [E1676]",
        more=(
            "[bodies.lower]\n"
            "mass = 1.0\n"
            "inertia = [1, 1, 1]\n"
            "\n"
            "[joints.elbow]\n"
            'type = "revolute"\n'
            'parent = "upper"\n'
            'child = "lower"\n'
            "axis = [0, 1, 0]\n"
            'mimic = { joint = "elbow" }'
        ),
    ),
    Failure(
        "A drive that jumps at times that are not known, smoothed",
        3,
        "description error: scene.toml:21 (joints.shoulder.drive): the times are not known beforehand at which sign()"
        " of something else than a straight line in t jumps; try: comparisons, sign, abs, min, max and curves of a t +"
        " b with fixed numbers a and b [E0289]",
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\ndrive = "0.2 * sign(sin(t))"\nsmooth = "10 ms"',
    ),
    Failure(
        "Nothing to smooth",
        3,
        "description error: scene.toml:21 (joints.shoulder.smooth): smooth needs a drive over time; try: no smooth,"
        " or a drive [E1623]",
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\nsmooth = "10 ms"',
    ),
    Failure(
        "An input as a drive",
        3,
        "description error: scene.toml:21 (joints.shoulder.drive): the input 'motor' cannot be used here: a motion"
        " needs the derivatives of its law, and derivatives of inputs are not known (column 1); try: motion = true in"
        " the input, whose caller then gives rate and acceleration, too; or a curve at t [E1555]",
        old="axis = [0, 1, 0]",
        new='axis = [0, 1, 0]\ndrive = "motor"',
    ),
]
