"""Failure catalogue: elastic beams."""

from __future__ import annotations

from tests.failures.failure import Failure

BLADE = """\
[beams.blade]
length = 10
mass_per_length = 1.2
bending_y = { modes = 2, stiffness = 1.4e4 }

[joints.hub]
type = "fixed"
parent = "upper"
child = "blade"
"""

LOADED = """
[distributed_loads.wind]
beam = "blade"
force = [0, 0, -3]
"""


def _changed(*changes: tuple[str, str]) -> str:
    """Return the blade with texts replaced, each of which it has once."""
    text = BLADE
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


FAILURES = [
    Failure("A beam with negative stiffness", 3, more=_changed(("stiffness = 1.4e4", "stiffness = -1.4e4"))),
    Failure("A beam with negative mass", 3, more=_changed(("mass_per_length = 1.2", "mass_per_length = -1.2"))),
    Failure("A beam of no length", 3, more=_changed(("length = 10\n", "length = 0\n"))),
    Failure("A beam without a stiffness", 3, more=_changed(("modes = 2, stiffness = 1.4e4", "modes = 2"))),
    Failure("A beam without a mass", 3, more=_changed(("mass_per_length = 1.2\n", ""))),
    Failure("A beam without a number of modes", 3, more=_changed(("modes = 2, ", ""))),
    Failure("A beam that deforms in no way", 3, more=_changed(("bending_y = { modes = 2, stiffness = 1.4e4 }\n", ""))),
    Failure(
        "A stiffness whose unit is not one",
        3,
        "description error: scene.toml:36 (beams.blade.bending_y.stiffness): '14 kN/m' is a stiffness, a "
        'quantity in N m^2 is expected; try: "14000 N m^2" [E0303]',
        more=_changed(("stiffness = 1.4e4", 'stiffness = "14 kN/m"')),
    ),
    Failure(
        "A section without second moments",
        3,
        "description error: scene.toml:36 (beams.blade.bending_y): the key stiffness is missing; try: "
        "stiffness = ..., or second_moments in the section [E1317]",
        more=_changed(
            ("mass_per_length = 1.2", 'section = { elastic_modulus = "70 GPa", density = 2700, area = "4 cm^2" }'),
            ("modes = 2, stiffness = 1.4e4", "modes = 2"),
        ),
    ),
    Failure(
        "A mass beside a section",
        3,
        "description error: scene.toml:35 (beams.blade.mass_per_length): mass_per_length is given, and "
        "follows from the section too; try: one of them; mass_profile for a mass that varies [E1318]",
        more=_changed(
            (
                "mass_per_length = 1.2",
                (
                    "mass_per_length = 1.2\n"
                    "section = { elastic_modulus = 7e10, density = 2700, area = 4e-4, second_moments = [2e-8, 2e-8] }"
                ),
            ),
        ),
    ),
    Failure(
        "Torsion without polar inertia",
        3,
        more=_changed(("bending_y = { modes = 2, stiffness = 1.4e4 }", "torsion = { modes = 1, stiffness = 900 }")),
    ),
    Failure(
        "A taper that vanishes at the tip",
        3,
        more=_changed(("mass_per_length = 1.2", "mass_per_length = 1.2\nmass_profile = [1, -1]")),
    ),
    Failure(
        "A taper that turns negative within",
        3,
        "description error: scene.toml:36 (beams.blade.bending_y.profile): the profile of the stiffness is "
        "-0.25 of its value at s = 0.5; try: coefficients of a polynomial above 0 for s from 0 to 1 [E1320]",
        more=_changed(("stiffness = 1.4e4", "stiffness = 1.4e4, profile = [1, -5, 5]")),
    ),
    Failure(
        "Free shapes of a beam whose end is held",
        3,
        "description error: scene.toml:36 (beams.blade.bending_y.shapes): free_free shapes "
        "move along y and turn about z where the joint hub holds them; try: shapes"
        ' = "clamped_free" [E1982]',
        more=_changed(("modes = 2,", 'shapes = "free_free", modes = 2,')),
    ),
    Failure(
        "More modes than the mesh has",
        3,
        more=_changed(("modes = 2,", 'shapes = "finite_elements", elements = 2, modes = 6,')),
    ),
    Failure(
        "A mesh without a number of elements",
        3,
        more=_changed(("modes = 2,", 'shapes = "finite_elements", modes = 2,')),
    ),
    Failure("Elements for shapes that have none", 3, more=_changed(("modes = 2,", "modes = 2, elements = 8,"))),
    Failure("Ends for shapes that have their own", 3, more=_changed(("modes = 2,", 'modes = 2, ends = "free_free",'))),
    Failure(
        "Modes of nodal coordinates",
        3,
        more=_changed(("modes = 2,", 'shapes = "finite_elements", coordinates = "nodal", elements = 4, modes = 2,')),
    ),
    Failure(
        "Initial values that do not match the modes",
        3,
        more=_changed(("stiffness = 1.4e4", "stiffness = 1.4e4, initial = { position = [0.1, 0, 0] }")),
    ),
    Failure(
        "A mass beyond a beam's mesh",
        3,
        more=_changed(
            ("modes = 2,", 'shapes = "finite_elements", elements = 8, modes = 2, masses = [{ at = 11, mass = 2 }],'),
        ),
    ),
    Failure("A negative damping ratio", 3, more=_changed(("modes = 2,", "modes = 2, damping_ratio = -0.01,"))),
    Failure("An inertia factor of zero", 3, more=_changed(("modes = 2,", "modes = 2, inertia_factor = 0,"))),
    Failure(
        "A point beyond a beam",
        3,
        more=_changed(('child = "blade"', 'child = "blade"\n\n[points.end]\nbody = "blade"\nposition = [10.5, 0, 0]')),
    ),
    Failure(
        "A place on a beam that can be tuned",
        3,
        "description error: scene.toml:45 (forces.wind.point[0]): x on the beam blade depends on the tunable "
        "parameter load, and shapes are fixed; try: load without tunable, or a number [E1979]",
        more=_changed(
            (
                'child = "blade"',
                'child = "blade"\n\n[forces.wind]\nbody = "blade"\npoint = ["2 * load", 0, 0]\nforce = [0, 1, 0]',
            ),
        ),
    ),
    Failure(
        "A beam that floats without polar inertia",
        3,
        "description error: scene.toml:38 (joints.hub): the joint hub cannot be moved by a force: the bodies "
        "that it carries lack mass, or inertia about some axis, so the inertia matrix "
        "is singular; try: polar_inertia for the beam, or another joint [E1642]",
        more=_changed(('type = "fixed"\nparent = "upper"', 'type = "free"\nparent = "base"')),
    ),
    Failure(
        "A beam in absolute coordinates",
        3,
        old='name = "arm"',
        new='name = "arm"\ncoordinates = "absolute"',
        more=BLADE,
    ),
    Failure(
        "An order that is not kept", 3, more=_changed(("mass_per_length = 1.2", "mass_per_length = 1.2\norder = 3"))
    ),
    Failure(
        "A beam whose stiffness a parameter makes negative",
        2,
        "usage error: scene.toml:36 (beams.blade.bending_y.stiffness): the stiffness of bending_y is -1000 at load ="
        " -1; try: a number above 0 [E1752]",
        command="linearize scene.toml --set load=-1",
        more=_changed(("stiffness = 1.4e4", 'stiffness = "1000 * sign(load)"')),
    ),
    Failure(
        "A mesh with too many nodal coordinates",
        3,
        more=_changed(("modes = 2,", 'shapes = "finite_elements", coordinates = "nodal", elements = 51,')),
    ),
    Failure("A distributed load on a rigid body", 3, more=BLADE + LOADED.replace('"blade"', '"upper"')),
    Failure("A distributed load without a profile", 3, more=BLADE + LOADED + "profile = [0, 0]\n"),
    Failure(
        "A distributed load in newtons",
        3,
        "description error: scene.toml:45 (distributed_loads.wind.force[2]): '3 N' is a force, a stiffness in N/m is "
        'expected; try: "3 N/m" [E0303]',
        more=BLADE + LOADED.replace("[0, 0, -3]", '[0, 0, "3 N"]'),
    ),
]
