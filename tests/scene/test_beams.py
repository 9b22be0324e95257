"""Beams in scene files: what is read, what follows from a section, where beams may sit, and the same scene by other
roads."""

from __future__ import annotations

import tomllib
from typing import Any

import jsonschema
import pytest
from scipy.integrate import quad

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.scene.bodies.model import Beam, Body
from eomgen.scene.document.reference import schema
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

HUB = """\
joints.hub = { type = "revolute", parent = "base", child = "blade", axis = [0, 0, 1] }
"""
BLADE = f"""\
format = 1
name = "blade"
{HUB}
[parameters]
flexural = {{ value = 1.4e4, unit = "N m^2", tunable = true }}
heaviness = {{ value = 1.2, unit = "kg/m", tunable = true }}
[beams.blade]
length = "1000 cm"
mass_per_length = "heaviness"
bending_y = {{ modes = 2, stiffness = "flexural", damping_ratio = 0.01, initial = {{ position = ["10 mm", 0] }} }}
"""


def read(text: str) -> Scene:
    return load_toml(text, file="blade.toml")


def beam_of(scene: Scene, name: str = "blade") -> tuple[Body, Beam]:
    body = next(body for body in scene.bodies if body.name == name)
    assert body.beam is not None
    return body, body.beam


def number(formula: Formula, **parameters: float) -> float:
    return evaluate(formula, lambda symbol: parameters[symbol.name])


def test_deformations_come_in_one_order() -> None:
    parts = ("torsion = { modes = 1, stiffness = 2 }", "stretch = { modes = 3, stiffness = 3 }")
    text = BLADE + "polar_inertia = 0.1\n" + "\n".join(parts) + "\nbending_z = { modes = 1, stiffness = 4 }\n"
    _, beam = beam_of(read(text))
    assert [item.kind for item in beam.deformations] == ["bending_y", "bending_z", "stretch", "torsion"]
    assert beam.size == 7


def test_what_follows_from_a_section() -> None:
    section = """\
bending_y = { modes = 1 }
bending_z = { modes = 1 }
stretch = { modes = 1 }
torsion = { modes = 1 }
[beams.blade.section]
elastic_modulus = "200 GPa"
density = 7800
area = "4 cm^2"
second_moments = ["3 cm^4", "1 cm^4"]
shear_modulus = "80 GPa"
torsion_constant = "2 cm^4"
"""
    body, beam = beam_of(read(f'format = 1\nname = "blade"\n{HUB}\n[beams.blade]\nlength = 2\n{section}'))
    stiffnesses = [number(item.stiffness) for item in beam.deformations]
    assert stiffnesses == pytest.approx([6000.0, 2000.0, 8e7, 1600.0], rel=1e-15)
    assert number(beam.mass_per_length) == pytest.approx(3.12, rel=1e-15)
    assert number(beam.polar_inertia) == pytest.approx(7800 * 4e-8, rel=1e-15)
    assert number(body.inertia[0]) == pytest.approx(2 * 7800 * 4e-8, rel=1e-15)


def test_mass_center_and_inertia_of_a_taper() -> None:
    profile, polar = (1.0, -0.9, 0.3), (1.0, 0.0, -0.5)
    text = (
        BLADE + f"start = -2.5\nmass_profile = {list(profile)}\npolar_profile = {list(polar)}\npolar_inertia = 0.02\n"
    )
    body, beam = beam_of(read(text.replace('"revolute"', '"free"').replace(", axis = [0, 0, 1]", "")))

    def along(power: int, coefficients: tuple[float, ...], about: float = 0.0) -> float:
        def integrand(x: float) -> float:
            s = (x + 2.5) / 10.0
            return (x - about) ** power * sum(entry * s**place for place, entry in enumerate(coefficients))

        return float(quad(integrand, -2.5, 7.5, epsabs=1e-13)[0])

    mass, center = along(0, profile), along(1, profile) / along(0, profile)
    assert beam.profiles == {"mass": profile, "polar": polar}
    assert number(body.mass, heaviness=1.2) == pytest.approx(1.2 * mass, rel=1e-14)
    assert number(body.center_of_mass[0]) == pytest.approx(center, rel=1e-14)
    assert number(body.inertia[1], heaviness=1.2) == pytest.approx(1.2 * along(2, profile, center), rel=1e-14)
    assert number(body.inertia[0]) == pytest.approx(0.02 * along(0, polar), rel=1e-14)


@pytest.mark.slow
def test_the_json_schema_takes_beams() -> None:
    jsonschema.Draft4Validator(schema()).validate(tomllib.loads(BLADE))
    wrong: dict[str, Any] = tomllib.loads(BLADE.replace("modes = 2", "modes = 0"))
    with pytest.raises(jsonschema.ValidationError, match=r"'modes': 0.* is not valid under any"):
        jsonschema.Draft4Validator(schema()).validate(wrong)


FREE_FREE = """\
format = 1
name = "frame"
[beams.bar]
length = 4
start = -2
mass_per_length = 3
polar_inertia = 0.1
{deformation}
"""


def with_joint(joint: str, deformation: str) -> Scene:
    return read(
        FREE_FREE.format(deformation=deformation) + f'[joints.carrier]\nparent = "base"\nchild = "bar"\n{joint}\n'
    )


BENDING_Y = 'bending_y = { shapes = "free_free", modes = 2, stiffness = 100 }'
BENDING_Z = 'bending_z = { shapes = "free_free", modes = 2, stiffness = 100 }'


@pytest.mark.parametrize(
    ("joint", "deformation"),
    [
        ('type = "free"', BENDING_Y),
        ('type = "free"', 'torsion = { shapes = "free_free", modes = 1, stiffness = 10 }'),
        ('type = "planar"\naxis = [0, 0, 1]', BENDING_Y),
        ('type = "planar"\naxis = [0, -1, 0]', BENDING_Z),
        ('type = "prismatic"\naxis = [1, 0, 0]', 'stretch = { shapes = "free_free", modes = 1, stiffness = 10 }'),
        ('type = "revolute"\naxis = [1, 0, 0]', 'torsion = { shapes = "free_free", modes = 1, stiffness = 10 }'),
        ('type = "revolute"\naxis = [1, 3e-8, 0]', 'torsion = { shapes = "free_free", modes = 1, stiffness = 10 }'),
        ('type = "planar"\naxis = [1e-9, 0, 1]', BENDING_Y),
    ],
)
def test_shapes_that_a_joint_lets_move(joint: str, deformation: str) -> None:
    assert with_joint(joint, deformation).bodies[0].beam is not None


@pytest.mark.parametrize(
    ("joint", "deformation", "motion"),
    [
        ('type = "planar"\naxis = [0, 1, 0]', BENDING_Y, "move along y and turn about z"),
        ('type = "revolute"\naxis = [0, 0, 1]', BENDING_Y, "move along y"),
        ('type = "prismatic"\naxis = [0, 0, 1]', BENDING_Z, "turn about y"),
        ('type = "spherical"', 'stretch = { shapes = "free_free", modes = 1, stiffness = 10 }', "move along x"),
        (
            'type = "revolute"\naxis = [0, 1, 1]',
            'torsion = { shapes = "free_free", modes = 1, stiffness = 10 }',
            "turn about x",
        ),
    ],
)
def test_shapes_that_a_joint_holds(joint: str, deformation: str, motion: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        with_joint(joint, deformation)
    assert f"free_free shapes {motion} where the joint carrier holds them" in str(caught.value)


def test_a_chain_of_joints_lets_a_beam_float() -> None:
    """Two joints with a massless body between leave the frame what a planar joint leaves."""
    chain = """
[bodies]
carrier = { mass = MASS }
[joints]
heave = { type = "prismatic", parent = "base", child = "carrier", axis = [0, 0, 1] }
pitch = { type = "revolute", parent = "carrier", child = "bar", axis = [0, 1, 0] }
"""
    text = FREE_FREE.format(deformation=BENDING_Z) + chain
    assert read(text.replace("MASS", "0")).bodies[1].beam is not None
    with pytest.raises(DescriptionError, match="move along z"):
        read(text.replace("MASS", "1"))


PLACED = {
    "forces.push.point": '[forces.push]\nbody = "blade"\npoint = [{x}, 0, 0]\nforce = [0, 0, 1]',
    "points.mark.position": '[points.mark]\nbody = "blade"\nposition = [{x}, 0, 0]',
    "frames.mark.position": '[frames.mark]\nbody = "blade"\nposition = [{x}, 0, 0]',
    "joints.end.position": '[bodies.nut]\nmass = 1\n[joints.end]\ntype = "fixed"\nparent = "blade"\nchild = "nut"\n'
    "position = [{x}, 0, 0]",
    "bushings.rubber.first.position": '[bushings.rubber]\nfirst = {{ body = "blade", position = [{x}, 0, 0] }}\n'
    'second = {{ body = "base" }}\nstiffness = [1e3, 1e3, 1e3]',
    "constraints.shut.second.position": '[constraints.shut]\ntype = "spherical"\nfirst = {{ body = "base" }}\n'
    'second = {{ body = "blade", position = [{x}, 0, 0] }}',
}


@pytest.mark.parametrize("key", PLACED)
def test_whatever_sits_on_a_beam_sits_between_its_ends(key: str) -> None:
    beam = BLADE
    assert read(f"{beam}{PLACED[key].format(x=9)}\n").bodies
    for x in (-1, 11):
        with pytest.raises(DescriptionError) as caught:
            read(f"{beam}{PLACED[key].format(x=x)}\n")
        (problem,) = caught.value.problems
        message = (
            f"({key}[0]): x = {x} m is beyond the beam blade, which goes from 0 m to 10 m; try: a place on the beam"
        )
        assert message in str(problem)


@pytest.mark.parametrize("start", [0, -4])
def test_pinned_shapes_at_either_end(start: int) -> None:
    deformation = 'bending_y = { shapes = "pinned_pinned", modes = 2, stiffness = 100 }'
    text = FREE_FREE.format(deformation=deformation).replace("start = -2", f"start = {start}")
    joint = '[joints.pin]\ntype = "revolute"\nparent = "base"\nchild = "bar"\naxis = [0, 0, 1]\n'
    assert read(text + joint).bodies[0].beam is not None
