"""Random blades in pybmodes: frequencies of uniform and tapered beams that stand or turn."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np

import eomgen
from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import Array, tape_evaluator

#: Frequencies that are compared, flapwise and edgewise ones together.
COUNT = 5
#: Elements of pybmodes, from which the limit is extrapolated: section properties are means over elements, so errors
#: fall with the square of their length.
MESHES = (60, 120)


@dataclass(frozen=True)
class Blade:
    """A blade that is clamped on a hub; mass and stiffness fall linearly to a part of them at the tip. SI units."""

    length: float
    hub: float
    mass: float
    flap: float
    edge: float
    tip: float
    speed: float

    @classmethod
    def random(cls, seed: int) -> Blade:
        """Return the blade of a seed: half of them are tapered, half of them turn."""
        rng = np.random.default_rng(seed)
        length, hub, mass = rng.uniform((10.0, 0.5, 50.0), (60.0, 3.0, 300.0))
        flap = mass * length**4 * rng.uniform(1.0, 3.0)  # the first frequency is about 3.5 to 6 rad/s
        tip, speed = rng.uniform((0.3, 0.5), (0.8, 6.0))
        return cls(
            length,
            hub,
            mass,
            flap,
            flap * rng.uniform(1.5, 4.0),
            tip if seed % 2 else 1.0,
            speed if seed // 2 % 2 else 0.0,
        )


def frequencies(seed: int) -> dict[str, float]:
    """Compare the lowest frequencies of a blade."""
    blade = Blade.random(seed)
    own, (coarse, fine) = _own(blade), (_pybmodes(blade, elements) for elements in MESHES)
    return {"frequencies": float(np.max(np.abs(own - fine - (fine - coarse) / 3.0) / own))}


def _own(blade: Blade) -> Array:
    """Return frequencies, Hz, with ten polynomials for each direction."""
    profile = [1.0, blade.tip - 1.0]
    shape = {"shapes": "polynomial", "modes": 10, "profile": profile}
    builder = eomgen.SceneBuilder("blade", gravity=[0, 0, 0]).base(rotation=[([0, 0, 1], f"{blade.speed} * t")])
    edge, flap = ({"stiffness": stiffness, **shape} for stiffness in (blade.edge, blade.flap))
    builder.beam(
        "blade", length=blade.length, mass_per_length=blade.mass, mass_profile=profile, bending_y=edge, bending_z=flap
    )
    builder.joint("clamp", "fixed", "base", "blade", position=[blade.hub, 0, 0])
    system = derive(builder.build(), ["partials"])
    evaluate = tape_evaluator(system)
    state = {"q": np.zeros((1, system.nq)), "t": np.zeros((1, 1))} | {name: np.zeros((1, system.nv)) for name in "va"}
    parts = evaluate("partials", {**state, **evaluate("base", state)})
    K, M = parts["K"][0], parts["M"][0]
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:COUNT]) / (2.0 * np.pi)


def _pybmodes(blade: Blade, elements: int) -> Array:
    """Return frequencies, Hz; of stretch and torsion they are far above the compared ones."""
    models = import_module("pybmodes.models")
    with tempfile.TemporaryDirectory() as folder:
        main = Path(folder) / "blade.bmi"
        main.write_text(_main_file(blade, elements), encoding="utf-8")
        main.with_name("sections.dat").write_text(_sections_file(blade), encoding="utf-8")
        return np.array(models.RotatingBlade(main).run(n_modes=COUNT).frequencies[:COUNT])


def _lines(*values: tuple[str, object]) -> Iterable[str]:
    """Yield lines of a file of pybmodes: a value and its name."""
    return (f"{value} {name}" for name, value in values)


def _main_file(blade: Blade, elements: int) -> str:
    general = {
        "echo": "false", "beam_type": 1, "rot_rpm:": float(blade.speed * 30.0 / np.pi), "rpm_mult": 1.0,
        "radius": float(blade.hub + blade.length), "hub_rad": float(blade.hub), "precone": 0.0, "bl_thp": 0.0,
        "hub_conn": 1, "modepr": 20, "TabDelim": "t", "mid_node_tw": "f",
    }  # fmt: skip  # a table
    tip = ("tip_mass", "cm_loc", "cm_axial", *(f"i{pair}_tip" for pair in ("xx", "yy", "zz", "xy", "zx", "yz")))
    stiffness = ("flp_stff", "edge_stff", "tor_stff", "axial_stff")
    scales = ("sec_mass", "flp_iner", "lag_iner", *stiffness, "cg_offst", "sc_offst", "tc_offst")
    parts = [
        "", "blade", "", "General", *_lines(*general.items()),
        "", "Tip", *_lines(*((name, 0.0) for name in tip)),
        "", "Sections", "1 id_mat:", "'sections.dat' sec_props_file",
        "", "Scales", *_lines(*((f"{name}_mult", 1.0) for name in scales)),
        "", "Mesh", f"{elements} nselt:", "", " ".join(str(float(s)) for s in np.linspace(0.0, 1.0, elements + 1)),
        "", "END",
    ]  # fmt: skip  # a file
    return "\n".join(parts) + "\n"


def _sections_file(blade: Blade) -> str:
    rotary, torsion, axial = 1e-8 * blade.mass * blade.length**2, blade.flap, 1e4 * blade.flap / blade.length**2
    lines = ["blade", "2 n_secs:", "", "names of the columns", "units"]
    for place, part in ((0.0, 1.0), (1.0, blade.tip)):
        inertia = [blade.mass * part, rotary, rotary]
        row = [place, 0.0, 0.0, *inertia, blade.flap * part, blade.edge * part, torsion, axial, 0.0, 0.0, 0.0]
        lines.append(" ".join(str(float(value)) for value in row))
    return "\n".join(lines) + "\n"
