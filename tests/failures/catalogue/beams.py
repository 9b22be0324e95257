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
        "A mass beside a section",
        3,
        "description error: scene.toml:35 (beams.blade.mass_per_length): mass_per_length is given, and "
        "follows from the section too; try: one of them [E1318]",
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
        "A mesh with too many nodal coordinates",
        3,
        more=_changed(("modes = 2,", 'shapes = "finite_elements", coordinates = "nodal", elements = 51,')),
    ),
    Failure("A distributed load on a rigid body", 3, more=BLADE + LOADED.replace('"blade"', '"upper"')),
    Failure("A distributed load without a profile", 3, more=BLADE + LOADED + "profile = [0, 0]\n"),
]
