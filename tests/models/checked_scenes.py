"""Small scenes that together have every term: a tree with internal states on a moving base, bodies in constraints, a
beam."""

from __future__ import annotations

from functools import cache

import eomgen


@cache
def drone() -> eomgen.Scene:
    """Return a drone that carries a pendulum: a moving base, lagging thrust, filters, inputs given and driven,
    outputs."""
    builder = eomgen.SceneBuilder("drone").parameter("lag", 0.05, tunable=True)
    builder.parameter("gust", 3.0, tunable=True).parameter("heave", 0.1, tunable=True)
    builder.input("command", "gust + sin(t)").input("twist")
    builder.base(
        position=["heave * sin(3 * t)", 0, "0.2 * t"], rotation=[([0, 0, 1], "0.3 * t"), ([1, 0, 0], "0.2 * sin(t)")]
    )
    builder.body("hull", 1.5, inertia=[0.02, 0.03, 0.04]).joint("flight", "free", "base", "hull")
    builder.body("rod", 0.4, center_of_mass=[0, 0, -0.3], inertia=[0.01, 0.01, 0.001])
    builder.joint("hinge", "revolute", "hull", "rod", axis=[0, 1, 0], position=[0.1, 0, 0], damping=0.01)
    builder.point("tip", "rod", [0, 0, -0.6]).point("anchor", "base", [0.4, 0.2, 1.0])
    builder.spring("cord", "tip", "anchor", stiffness=20, damping=0.3, length=0.5, force="2 * wound")
    builder.state("thrust", "(command * (1 + 0.1 * wound) - thrust) / lag - v.hinge + 0.1 * twist")
    builder.state("wound", "sin(q.hinge) * length.cord - wound ** 3 + 0.1 * rate.cord")
    builder.force("lift", "hull", force=[0, 0, "thrust * (1 + 0.2 * wound) + command"], axes="body")
    builder.effort("trim", "hinge", "0.3 * thrust * v.hinge - wound * q.hinge + twist * cos(q.hinge)")
    builder.output("thrust", formula=["thrust * v.hinge + a.hinge", "twist * q.hinge + command"])
    return builder.simulation(step=1e-3, duration=1.0).build()


@cache
def gate() -> eomgen.Scene:
    """Return two absolute bodies, one on a shaking base, the other driven against it, with a torque that is an
    input."""
    builder = eomgen.SceneBuilder("gate", coordinates="absolute").input("torque", "0.2 * sin(3 * t)").input("push")
    builder.parameter("place", 1.0, tunable=True).parameter("shake", 7.0, tunable=True)
    builder.base(position=["0.05 * sin(shake * t)", 0, 0], rotation=[([0, 0, 1], "0.1 * sin(2 * t)")])
    builder.body("leaf", 1.3, center_of_mass=[0.5, 0, 0], inertia=[0.02, 0.1, 0.1])
    builder.joint("hinge", "revolute", "base", "leaf", axis=[0, 0, 1], initial={"position": 0.3, "velocity": 0.5})
    builder.body("bolt", 0.4, inertia=[0.01, 0.02, 0.03])
    builder.joint(
        "slide", "prismatic", "leaf", "bolt", axis=[1, 0, 0], position=["place", 0, 0], initial={"position": 0.1}
    )
    builder.effort("closer", "hinge", "torque - 0.3 * v.hinge + 0.1 * push")
    return builder.output("angle", formula="q.hinge * push").simulation(step=1e-3, duration=1.0).build()


@cache
def rod() -> eomgen.Scene:
    """Return a damped beam that swings on a hinge, pulled along, with a mass at its end."""
    builder = eomgen.SceneBuilder("rod")
    non_smooth_entries = {"shapes": "clamped_free", "modes": 2, "stiffness": 20.0, "stiffness_damping": 1e-3}
    builder.beam("rod", length=1.2, mass_per_length=0.6, bending_y=non_smooth_entries)
    builder.body("tip", 0.3, inertia=[0.01, 0.01, 0.01])
    builder.joint("hinge", "revolute", "base", "rod", axis=[0, 0, 1], initial={"position": 0.4, "velocity": 3.0})
    builder.joint("end", "fixed", "rod", "tip", position=[1.2, 0, 0])
    builder.force("pull", "rod", force=[4, 0, 0], point=[0.6, 0, 0], axes="body")
    return builder.simulation(step=1e-3, duration=1.0).build()


@cache
def reed() -> eomgen.Scene:
    """Return a curved beam that bends, twists and stretches, but does not shear, free in the air."""
    builder = eomgen.SceneBuilder("reed")
    builder.beam(
        "reed", model="kirchhoff", length=1.2, elements=2, curvature=[0.3, -0.4, 0.2], mass_per_length=0.6,
        rotary_inertia=[2e-3, 1e-3, 1e-3], stiffness={"stretch": 900, "torsion": 15, "bending_y": 20, "bending_z": 30},
        damping={"stretch": 0.3, "bending_y": 0.1},
    )  # fmt: skip  # the section on a line
    builder.joint("flight", "free", "base", "reed", initial={"velocity": [0.3, -0.2, 0.4, 0.5, 0.1, 0.2]})
    return builder.simulation(step=1e-3, duration=1.0).build()


@cache
def striker() -> eomgen.Scene:
    """A double pendulum with an impact, a reset and an event of rates."""
    builder = eomgen.SceneBuilder("striker").body("upper", 2.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.01])
    builder.body("lower", 1.0, center_of_mass=[0, 0, -0.4], inertia=[0.05, 0.05, 0.01])
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, 1, 0], initial={"position": 1.0})
    builder.joint("elbow", "revolute", "upper", "lower", axis=[0, 1, 0], position=[0, 0, -1.0])
    builder.point("tip", "lower", [0, 0, -0.8]).state("lag", "q.elbow - lag")
    builder.event("floor", "position.tip[2] + 1.5", direction="falling", action="impact", restitution=0.6)
    builder.event("swing", "v.elbow*lag + velocity.tip[2]*sin(t)", action="reset", reset={"lag": "0.5*lag"})
    return builder.build()
