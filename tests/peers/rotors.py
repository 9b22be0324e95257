"""Random rotors in ROSS: a flexible shaft with discs on bearings, eigenvalues over the speed."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

import numpy as np

import eomgen
from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import Array, tape_evaluator

SPEEDS = (0.0, 150.0, 600.0)
#: Eigenvalues are compared up to this size, rad/s.
FASTEST = 3000.0
ELEMENTS = 6
MODULUS, DENSITY = 2.1e11, 7850.0


@dataclass(frozen=True)
class Rotor:
    """A shaft without shear, with two discs that turn and a bearing at each end.

    Attributes
    ----------
    discs : (node, mass, transverse and polar moment of inertia)
    bearings : (node, stiffness along two axes, damping along two axes)
    """

    length: float
    diameter: float
    discs: list[tuple[int, float, float, float]]
    bearings: list[tuple[int, list[float], list[float]]]

    @classmethod
    def random(cls, seed: int) -> Rotor:
        """Return the rotor of a seed."""
        rng = np.random.default_rng(seed)
        discs = []
        for node in rng.choice(np.arange(1, ELEMENTS), 2, replace=False):
            mass, radius, width = rng.uniform((5.0, 0.08, 0.02), (40.0, 0.25, 0.06))
            discs.append((int(node), mass, mass * (radius**2 / 4 + width**2 / 12), mass * radius**2 / 2))
        bearings = [
            (node, rng.uniform(1e6, 2e7, 2).tolist(), rng.uniform(100.0, 2000.0, 2).tolist()) for node in (0, ELEMENTS)
        ]
        return cls(float(rng.uniform(0.8, 1.6)), float(rng.uniform(0.03, 0.06)), discs, bearings)


def modes(seed: int) -> dict[str, float]:
    """Compare eigenvalues of bending at several speeds; both programs have cubic elements on one mesh."""
    rotor = Rotor.random(seed)
    found = {}
    for speed, own, theirs in zip(SPEEDS, _own(rotor), _ross(rotor), strict=True):
        assert len(own) == len(theirs) > 0, f"{len(own)} eigenvalues, {len(theirs)} of ROSS at {speed} rad/s"
        nearest = [np.min(np.abs(own - value)) / np.abs(value) for value in theirs]
        found[f"eigenvalues at {speed:g} rad/s"] = float(np.max(nearest))
    return found


def _kept(eigenvalues: Array) -> Array:
    """Return the eigenvalues that oscillate and are not too fast."""
    return eigenvalues[(eigenvalues.imag > 1.0) & (np.abs(eigenvalues) < FASTEST)]


def _own(rotor: Rotor) -> list[Array]:
    """Return eigenvalues of the linear equations about spinning discs on a shaft that stands, at each speed."""
    area, second = np.pi * rotor.diameter**2 / 4, np.pi * rotor.diameter**4 / 64
    mesh = {"shapes": "finite_elements", "elements": ELEMENTS, "ends": "free_free", "modes": 2 * ELEMENTS}
    bending = {**mesh, "stiffness": MODULUS * second}
    builder = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0])
    mass, polar = DENSITY * area, 2.0 * DENSITY * second
    builder.beam("shaft", rotor.length, mass_per_length=mass, polar_inertia=polar, bending_y=bending, bending_z=bending)
    builder.joint("root", "free", "base", "shaft")
    for k, (node, weight, across, along) in enumerate(rotor.discs):
        builder.body(f"disc{k}", weight, inertia=[along, across, across])
        place = [rotor.length * node / ELEMENTS, 0, 0]
        builder.joint(f"spin{k}", "revolute", "shaft", f"disc{k}", axis=[1, 0, 0], position=place)
    for k, (node, stiffness, damping) in enumerate(rotor.bearings):
        ends = ({"body": body, "position": [rotor.length * node / ELEMENTS, 0, 0]} for body in ("base", "shaft"))
        builder.bushing(f"bearing{k}", *ends, stiffness=[0.0, *stiffness], damping=[0.0, *damping])
    system = derive(builder.build(), ["partials"])
    evaluate, n = tape_evaluator(system), system.nv
    spins = [factor.v_start for factor in system.factors if factor.name.startswith("spin")]
    found = []
    for speed in SPEEDS:
        q, v = np.zeros((1, system.nq)), np.zeros((1, n))
        q[0, 0], v[0, spins] = 1.0, speed  # the first number is of the shaft's quaternion
        parts = evaluate("partials", {"q": q, "v": v, "a": np.zeros_like(v), "t": np.zeros((1, 1))})
        K, C, M = (parts[name][0] for name in "KCM")
        matrix = np.vstack([np.eye(n, 2 * n, n), np.linalg.solve(M, np.hstack([-K, -C]))])
        found.append(_kept(np.linalg.eigvals(matrix)))
    return found


def _ross(rotor: Rotor) -> list[Array]:
    """Return ROSS' eigenvalues of bending at each speed."""
    ross = import_module("ross")
    steel = ross.Material("steel", rho=DENSITY, E=MODULUS, Poisson=0.3)
    slender = {"shear_effects": False, "rotary_inertia": False, "gyroscopic": False, "material": steel}
    assembly = ross.Rotor(
        [ross.ShaftElement(rotor.length / ELEMENTS, 0.0, rotor.diameter, **slender) for _ in range(ELEMENTS)],
        [ross.DiskElement(n=node, m=mass, Id=transverse, Ip=polar) for node, mass, transverse, polar in rotor.discs],
        [ross.BearingElement(n=node, kxx=k[0], kyy=k[1], cxx=c[0], cyy=c[1]) for node, k, c in rotor.bearings],
    )
    found = []
    for speed in SPEEDS:
        modal = assembly.run_modal(speed, sparse=False, num_modes=2 * assembly.ndof)
        # at each node: along and about x, y of the section, and z, the axis
        sizes = np.abs(modal.evectors[: assembly.ndof].reshape(-1, 6, len(modal.evalues)))
        bending = np.max(sizes[:, [0, 1, 3, 4]], axis=(0, 1)) > np.max(sizes[:, [2, 5]], axis=(0, 1))
        found.append(_kept(modal.evalues[bending]))
    return found
