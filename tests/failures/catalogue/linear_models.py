"""Failure catalogue: linear models on the command line."""

from __future__ import annotations

from tests.failures.failure import Failure

FALLING = """\
format = 1
name = "falling"
[bodies]
stone = { mass = 1, inertia = [0.1, 0.1, 0.1] }
[joints.flight]
type = "free"
parent = "base"
child = "stone"
"""

FAILURES = [
    Failure("A state that there is not", 2, command="linearize scene.toml --at rest"),
    Failure(
        "No equilibrium to linearise about",
        6,
        command="linearize falling.toml --at equilibrium",
        files={"falling.toml": FALLING},
    ),
    Failure(
        "Balance at an instant only",
        6,
        "numerical error: steady motion: forces balance at this instant only: "
        "later v.shoulder accelerates with 23.1 rad/s^2; try: centres of mass on the axis of shoulder "
        "(the centre of upper is 0.25 m off, 0.5 kg m), with gravity and springs that are the same all round it; "
        "unbalance acts on the balanced rotor as a force that turns (docs/python.md, Rotors) [E0094]",
        command="linearize scene.toml --at steady --velocity shoulder=2 --input motor=0",
    ),
    Failure("A velocity without a steady motion", 2, command="linearize scene.toml --velocity shoulder=2"),
    Failure("A response without a folder", 2, command="linearize scene.toml --response motor:tip[0]"),
    Failure(
        "A response without a folder, of an output that there is not",
        2,
        command="linearize scene.toml --response motor:top",
    ),
    Failure("A response that is not one", 2, command="linearize scene.toml --out out --response motor"),
    Failure("A band without an end", 2, command="linearize scene.toml --out out --response motor:tip[0] --band 10"),
    Failure("Roots over no values", 2, command="linearize scene.toml --out out --root-locus load=1:2"),
    Failure("Equal ratios through zero", 2, command="linearize scene.toml --out out --root-locus load=0:2:10:log"),
    Failure(
        "Roots over a parameter that is fixed",
        2,
        command="linearize scene.toml --out out --root-locus length=0.4:0.6:5",
    ),
    Failure("A ride without a road", 2, command="linearize scene.toml --ride tip[0]"),
    Failure(
        "A ride on the road of a machine without damping",
        4,
        command="linearize scene.toml --ride tip[0]",
        old='motor = { formula = "2 * sin(t)", unit = "N m" }',
        new='motor = { road = { class = "C", speed = 20 } }',
    ),
    Failure("A speed backwards", 2, command="linearize scene.toml --ride tip[0] --speeds 10,-20"),
    Failure("Speeds of no ride", 2, command="linearize scene.toml --speeds 10,20"),
    Failure("A diagram over a speed that there is not", 2, command="linearize scene.toml --campbell spin=0:100:5"),
    Failure("Orders of no diagram", 2, command="linearize scene.toml --orders 1,2"),
    Failure("An order backwards", 2, command="linearize scene.toml --campbell load=1:2:3 --orders 1,-2"),
    Failure(
        "A Campbell diagram from the largest speed down",
        2,
        command="linearize scene.toml --campbell load=3:1:3",
    ),
    Failure("A whirl of one deflection", 2, command="linearize scene.toml --campbell load=1:2:3 --whirl tip[0]"),
]
