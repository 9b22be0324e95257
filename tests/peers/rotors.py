"""Random rotors in ROSS: a flexible shaft with discs on bearings, eigenvalues over the speed."""

from __future__ import annotations

import numpy as np

import eomgen
from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import Array, tape_evaluator

SPEEDS = (0.0, 150.0, 600.0)
#: Eigenvalues are compared up to this rate, rad/s: higher ones have few elements for a wave.
FASTEST = 3000.0


def ross_rotors(seed: int) -> dict[str, float]:
    """Compare eigenvalues, by their size, at several speeds; both have cubic elements on one mesh."""
    rng = np.random.default_rng(seed)
    elements, length, diameter = 6, float(rng.uniform(0.8, 1.6)), float(rng.uniform(0.03, 0.06))
    modulus, density = 2.1e11, 7850.0
    discs = [(int(node), *_disc(rng)) for node in rng.choice(np.arange(1, elements), 2, replace=False)]
    bearings = [
        (node, rng.uniform(1e6, 2e7, 2).tolist(), rng.uniform(100.0, 2000.0, 2).tolist()) for node in (0, elements)
    ]
    own = _own_eigenvalues(length, diameter, elements, modulus, density, discs, bearings)
    theirs = _ross_eigenvalues(length, diameter, elements, modulus, density, discs, bearings)
    found = {}
    for speed, mine, other in zip(SPEEDS, own, theirs, strict=True):
        assert len(mine) == len(other), f"{len(mine)} and {len(other)} eigenvalues at {speed}"
        nearest = [np.min(np.abs(mine - value)) / np.abs(value) for value in other]
        found[f"eigenvalues at {speed:g} rad/s"] = float(np.max(nearest))
    return found


def _disc(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return mass, transverse and polar moment of inertia of a random disc."""
    mass, radius, width = rng.uniform(5.0, 40.0), rng.uniform(0.08, 0.25), rng.uniform(0.02, 0.06)
    return float(mass), float(mass * (radius**2 / 4 + width**2 / 12)), float(mass * radius**2 / 2)


Disc = tuple[int, float, float, float]
Bearing = tuple[int, list[float], list[float]]


def _kept(eigenvalues: Array) -> Array:
    """Return the eigenvalues of bending that are compared."""
    return eigenvalues[(eigenvalues.imag > 1.0) & (np.abs(eigenvalues) < FASTEST)]


def _own_eigenvalues(
    length: float, diameter: float, elements: int, modulus: float, density: float, discs: list[Disc], bearings: list[Bearing]
) -> list[Array]:
    area, second = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    bending = {
        "shapes": "finite_elements", "elements": elements, "ends": "free_free",
        "modes": 2 * elements, "stiffness": modulus * second,
    }  # fmt: skip  # a table
    builder = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0])
    builder.beam(
        "shaft", length=length, mass_per_length=density * area, polar_inertia=2.0 * density * second, bending_y=bending, bending_z=bending
    )
    builder.joint("root", "free", "base", "shaft")
    for k, (node, mass, transverse, polar) in enumerate(discs):
        builder.body(f"disc{k}", mass, inertia=[polar, transverse, transverse])
        place = [length * node / elements, 0, 0]
        builder.joint(f"spin{k}", "revolute", "shaft", f"disc{k}", axis=[1, 0, 0], position=place)
    for k, (node, stiffness, damping) in enumerate(bearings):
        place = [length * node / elements, 0, 0]
        builder.bushing(
            f"bearing{k}", {"body": "base", "position": place}, {"body": "shaft", "position": place},
            stiffness=[0.0, *stiffness], damping=[0.0, *damping],
        )  # fmt: skip  # a table
    system = derive(builder.build(), ["partials"])
    evaluate, found = tape_evaluator(system), []
    q = np.zeros((1, system.nq))
    q[0, 0] = 1.0  # the shaft's frame
    for speed in SPEEDS:
        v = np.zeros((1, system.nv))
        for factor in system.factors:
            v[0, factor.v_start] = speed if factor.name.startswith("spin") else 0.0
        parts = evaluate("partials", {"q": q, "v": v, "a": np.zeros_like(v), "t": np.zeros((1, 1))})
        K, C, M = (parts[name][0] for name in "KCM")
        own = np.linalg.solve(M, np.hstack([-K, -C]))
        found.append(_kept(np.linalg.eigvals(np.vstack([np.eye(system.nv, 2 * system.nv, system.nv), own]))))
    return found


def _ross_eigenvalues(
    length: float, diameter: float, elements: int, modulus: float, density: float, discs: list[Disc], bearings: list[Bearing]
) -> list[Array]:
    import ross

    steel = ross.Material("steel", rho=density, E=modulus, Poisson=0.3)
    slender = {"shear_effects": False, "rotary_inertia": False, "gyroscopic": False}
    shaft = [ross.ShaftElement(length / elements, 0.0, diameter, material=steel, **slender) for _ in range(elements)]
    rotor = ross.Rotor(
        shaft,
        [ross.DiskElement(n=node, m=mass, Id=transverse, Ip=polar) for node, mass, transverse, polar in discs],
        [ross.BearingElement(n=node, kxx=k[0], kyy=k[1], cxx=c[0], cyy=c[1]) for node, k, c in bearings],
    )
    found = []
    for speed in SPEEDS:
        modal = rotor.run_modal(speed, sparse=False, num_modes=2 * rotor.ndof)
        sizes = np.abs(modal.evectors[: rotor.ndof].reshape(-1, 6, len(modal.evalues)))  # x, y, z, about x, y, z at nodes
        bending = np.max(sizes[:, [0, 1, 3, 4]], axis=(0, 1)) > np.max(sizes[:, [2, 5]], axis=(0, 1))
        found.append(_kept(modal.evalues[bending]))
    return found
