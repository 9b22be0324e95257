"""Random blades in pybmodes: frequencies of uniform and tapered beams that stand or turn."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import eomgen
from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import Array, tape_evaluator

#: Frequencies that are compared, flapwise and edgewise ones together.
COUNT = 5
#: The meshes of pybmodes, from which the limit is extrapolated: section properties are means over elements, so errors
#: fall with the square of their length.
MESHES = (60, 120)


def pybmodes_blades(seed: int) -> dict[str, float]:
    """Compare the lowest frequencies of a blade; half of the blades are tapered, half of them turn."""
    rng = np.random.default_rng(seed)
    length, hub, mass = rng.uniform(10.0, 60.0), rng.uniform(0.5, 3.0), rng.uniform(50.0, 300.0)
    flap = mass * length**4 * rng.uniform(1.0, 3.0)  # the first frequency is about 3.5 to 6 rad/s
    edge = flap * rng.uniform(1.5, 4.0)
    tip = rng.uniform(0.3, 0.8) if seed % 2 else 1.0
    speed = rng.uniform(0.5, 6.0) if seed // 2 % 2 else 0.0
    own = _own(length, hub, mass, flap, edge, tip, speed)
    coarse, fine = (_pybmodes(length, hub, mass, flap, edge, tip, speed, elements) for elements in MESHES)
    theirs = fine + (fine - coarse) / 3.0
    return {"frequencies": float(np.max(np.abs(own - theirs) / own))}


def _own(length: float, hub: float, mass: float, flap: float, edge: float, tip: float, speed: float) -> Array:
    """Return frequencies, Hz; 10 polynomials for each direction."""
    shape = {"shapes": "polynomial", "modes": 10, "profile": [1.0, tip - 1.0]}
    builder = eomgen.SceneBuilder("blade", gravity=[0, 0, 0]).base(rotation=[([0, 0, 1], f"{speed} * t")])
    builder.beam(
        "blade", length=length, mass_per_length=mass, mass_profile=[1.0, tip - 1.0],
        bending_y={"stiffness": edge, **shape}, bending_z={"stiffness": flap, **shape},
    )  # fmt: skip  # a table
    builder.joint("clamp", "fixed", "base", "blade", position=[hub, 0, 0])
    system = derive(builder.build(), ["partials"])
    evaluate = tape_evaluator(system)
    state = {"q": np.zeros((1, system.nq)), "v": np.zeros((1, system.nv)), "a": np.zeros((1, system.nv)), "t": np.zeros((1, 1))}
    state["base"] = evaluate("base", state)["base"]
    parts = evaluate("partials", state)
    K, C, M = (parts[name][0] for name in "KCM")
    assert np.max(np.abs(C)) < 1e-9 * np.max(np.abs(K)), "edgewise and axial motions are coupled"
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:COUNT]) / (2.0 * np.pi)


def _pybmodes(
    length: float, hub: float, mass: float, flap: float, edge: float, tip: float, speed: float, elements: int
) -> Array:
    """Return frequencies, Hz, of the same blade: its axial and torsional frequencies are far above the others."""
    from pybmodes.models import RotatingBlade

    rotary, torsion, axial = 1e-8 * mass * length**2, flap, 1e4 * flap / length**2

    def section(place: float, factor: float) -> str:
        values = [place, 0, 0, mass * factor, rotary, rotary, flap * factor, edge * factor, torsion, axial, 0, 0, 0]
        return " ".join(repr(float(value)) for value in values)

    names = "sec_loc str_tw tw_iner mass_den flp_iner edge_iner flp_stff edge_stff tor_stff axial_stff cg_offst sc_offst tc_offst"
    sections = f"blade\n2 n_secs:\n\n{names}\n(units)\n{section(0.0, 1.0)}\n{section(1.0, tip)}\n"
    values: list[tuple[str, object]] = [
        ("echo", "false"), ("beam_type", 1), ("rot_rpm:", speed * 30.0 / np.pi), ("rpm_mult", 1.0),
        ("radius", hub + length), ("hub_rad", hub), ("precone", 0.0), ("bl_thp", 0.0), ("hub_conn", 1), ("modepr", 20),
        ("TabDelim", "t"), ("mid_node_tw", "f"),
    ]  # fmt: skip  # a table
    mains = "\n".join(f"{float(v)!r} {k}" if isinstance(v, float) else f"{v} {k}" for k, v in values)
    tips = "\n".join(
        f"0. {name}" for name in ("tip_mass", "cm_loc", "cm_axial", "ixx_tip", "iyy_tip", "izz_tip", "ixy_tip", "izx_tip", "iyz_tip")
    )
    scales = "\n".join(
        f"1.0 {name}_mult" for name in ("sec_mass", "flp_iner", "lag_iner", "flp_stff", "edge_stff", "tor_stff", "axial_stff", "cg_offst", "sc_offst", "tc_offst")
    )
    mesh = " ".join(repr(float(place)) for place in np.linspace(0.0, 1.0, elements + 1))
    text = (
        f"= Main =\nblade\n\n- General -\n{mains}\n\n- Tip -\n{tips}\n\n- Sections -\n1 id_mat:\n'sections.dat' sec_props_file\n\n"
        f"Scaling\n{scales}\n\n- Mesh -\n{elements} nselt:\nnodes\n{mesh}\n\nEND\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sections.dat").write_text(sections, encoding="utf-8")
        main = Path(folder) / "blade.bmi"
        main.write_text(text, encoding="utf-8")
        return np.array(RotatingBlade(main).run(n_modes=COUNT).frequencies[:COUNT])
