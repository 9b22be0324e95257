"""Examples of the builder's methods, by method, for ``help``: each goes on from the arm of the builder's docstring."""

from __future__ import annotations

from collections.abc import Mapping

EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "base": ('arm = arm.base(position=["0.04 * sin(5 * t)", 0, 0])',),
    "beam": (
        'arm = arm.beam("boom", "1.5 m", mass_per_length=1.2, bending_y={"modes": 2, "stiffness": 40})',
        'arm = arm.joint("clamp", "fixed", "lower", "boom", position=[0, 0, -0.4])',
    ),
    "body": ('arm = arm.body("load", "500 g").joint("grip", "fixed", "lower", "load", position=[0, 0, -0.4])',),
    "bushing": (
        'arm = arm.bushing("mount", {"point": "mount"}, {"point": "tip"}, stiffness=["10 kN/m", "10 kN/m", "80 kN/m"])',
    ),
    "constraint": ('arm = arm.constraint("rod", "distance", {"point": "mount"}, {"point": "tip"})',),
    "controller": (
        'arm = arm.controller("servo", "pid", "0.5 - q.elbow", proportional=40, derivative=4, time_constant="5 ms")',
        'arm = arm.effort("servo", "elbow", "servo")',
    ),
    "curve": ('arm = arm.curve("ramp", points=[[0, 0], [1, 5]]).effort("motor", "elbow", "ramp(t)")',),
    "definition": (
        'arm = arm.definition("reach", "sqrt(position.tip[0]**2 + position.tip[2]**2)")',
        'arm = arm.output("reach", formula="reach", unit="m")',
    ),
    "distributed_load": (
        'section = {"stretch": 1e4, "shear_y": 4e3, "shear_z": 4e3}',
        'section |= {"torsion": 1, "bending_y": 2, "bending_z": 2}',
        'whip = {"elements": 4, "mass_per_length": 0.1, "rotary_inertia": [1e-4, 5e-5, 5e-5], "stiffness": section}',
        'arm = arm.beam("whip", 1.0, model="cosserat", **whip)',
        'arm = arm.joint("clamp", "fixed", "lower", "whip", position=[0, 0, -0.4])',
        'arm = arm.distributed_load("wind", "whip", force=[0, "3 N/m", 0])',
    ),
    "doubts": ('arm = arm.doubts(quiet=["unused names"], strict=True)',),
    "effort": ('arm = arm.effort("motor", "elbow", "2 * sin(3 * t) - 0.1 * v.elbow")',),
    "event": ('arm = arm.event("down", "q.shoulder", direction="falling", action="stop")',),
    "force": ('arm = arm.force("push", "lower", point=[0, 0, -0.4], force=["5 N", 0, 0])',),
    "frame": ('arm = arm.frame("tool", "lower", position=[0, 0, -0.4], rotation=[([1, 0, 0], "180 deg")])',),
    "contact": (
        'law = {"type": "linear", "stiffness": "20 kN/m"}',
        'arm = arm.contact("floor", {"body": "base", "axis": [0, 0, 1]}, "tip", shape="point", normal=law)',
    ),
    "hull": (
        'arm = arm.waves("sea", spectrum={"type": "jonswap", "height": "2 m", "period": "8 s"})',
        'arm = arm.hull("leg", "lower", start=[0, 0, 0], end=[0, 0, -0.4], diameter="80 mm", waves="sea")',
    ),
    "include": ('arm = arm.include("crank", file="examples/four_bar/scene.toml")',),
    "input": ('arm = arm.input("motor", unit="N m").effort("motor", "elbow", "motor")',),
    "joint": (
        'arm = arm.body("slider", "300 g")',
        'arm = arm.joint("slide", "prismatic", "lower", "slider", axis=[0, 0, 1], damping="2 N s/m")',
    ),
    "law": (
        "from pathlib import Path",
        r'_ = Path("drag.py").write_text("def drag(speed):\n    return 0.2 * speed\n")',
        'speed = {"speed": "rad/s"}',
        'arm = arm.law("drag", python="drag.py", function="drag", arguments=speed, results={"torque": "N m"})',
        'arm = arm.effort("air", "elbow", "-law.drag(v.elbow)")',
    ),
    "map": (
        'arm = arm.map("torque", x=[0, 1], y=[-10, 10], values=[[0, 1], [2, 3]])',
        'arm = arm.effort("motor", "elbow", "map.torque(q.elbow, v.elbow)")',
    ),
    "mode": ('arm = arm.mode("gear", 1).effort("motor", "elbow", "3 * mode.gear")',),
    "output": ('arm = arm.output("tip", position="tip", unit="m").output("power", formula="2 * v.elbow", unit="W")',),
    "parameter": (
        'arm = arm.parameter("load", "500 g", tunable=True).body("load", "load")',
        'arm = arm.joint("grip", "fixed", "lower", "load", position=[0, 0, -0.4])',
    ),
    "point": ('arm = arm.point("grip", "lower", position=[0, 0, "-40 cm"])',),
    "random": (
        'arm = arm.random("gust", "squared_exponential", correlation_time="1 s", standard_deviation=2, unit="N")',
        'arm = arm.force("gust", "lower", force=["gust", 0, 0])',
    ),
    "reaction": ('arm = arm.reaction("grip", joint="elbow", point="tip").output("bearing", reaction_moment="grip")',),
    "reference": (
        'arm = arm.reference("plan", position={"shoulder": "0.5 * sin(t)", "elbow": "0"})',
        'arm = arm.effort("motor", "elbow", "tau.elbow(plan)")',
    ),
    "shape": ('arm = arm.shape("rod", "cylinder", "lower", position=[0, 0, -0.2], radius="20 mm", length="40 cm")',),
    "simulation": ('arm = arm.simulation(method="rk4", step="1 ms", duration="5 s")',),
    "spring": ('arm = arm.spring("strut", "mount", "tip", stiffness="2 kN/m", damping=30, length="0.4 m")',),
    "state": (
        'arm = arm.state("filtered", rate="(v.elbow - filtered) / 0.02").effort("damper", "elbow", "-0.5 * filtered")',
    ),
    "tendon": ('arm = arm.tendon("cable", points=["mount", "tip"], stiffness="2 kN/m", damping=30, length="0.4 m")',),
    "torsion_spring": ('arm = arm.torsion_spring("belt", "shoulder", "elbow", stiffness="5 N m/rad")',),
    "tyre": ('arm = arm.tyre("foot", "tip", radius="100 mm", stiffness="20 kN/m", damping=200)',),
    "waves": ('arm = arm.waves("sea", spectrum={"type": "jonswap", "height": "2 m", "period": "8 s"})',),
}
