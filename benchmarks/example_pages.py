"""Speed against accuracy of every example, measured and written into its page of ``docs/examples``.

    python -m benchmarks.example_pages [NAME ...] [--folder out/examples] [--keep]

For each folder of ``examples`` this runs the command of its page (``STUDIES`` has the options), and replaces what
stands between the marks of ``docs/examples/NAME.md``, and the example's row in the table of
``docs/examples/README.md``. The rest of these pages is written by hand; their pictures are drawn with the site.
``--keep`` writes from the studies that the folder holds already.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from eomgen.studies import Point, Tradeoff

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "examples"
#: Demands of a page's table, and of the table of all pages.
DEMANDS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
TOLD = (1e-3, 1e-6)
BEGIN, END = "<!-- measured -->", "<!-- end of the measured part -->"


#: What every study varies.
VARIED = "--axes method,resolution"
#: Methods that are compared without and with constraints. Others, as HHT and Newmark, differ from generalized-alpha in
#: their damping only, and lie on its line.
FREE = "generalized_alpha,generalized_alpha_adaptive,rk4,rk45,taylor"
BOUND = "generalized_alpha,generalized_alpha_index3,generalized_alpha_adaptive,rk4_partitioned"
#: Of stiff scenes with constraints, as beams in loops.
IMPLICIT = "generalized_alpha,generalized_alpha_index3,generalized_alpha_adaptive,rosenbrock"
#: Of hundreds of free bodies, whose Taylor series are long texts.
MANY_BODIES = "generalized_alpha,generalized_alpha_adaptive,rk4,rk45"


@dataclass(frozen=True)
class Study:
    """What is measured of an example: the scene's file, the options of ``eomgen tradeoff`` besides ``VARIED``, and the
    seconds that it may compute."""

    options: str = ""
    file: str = "scene.toml"
    methods: str = FREE
    budget: int = 40


#: Folder of ``examples`` -> its study. Long runs over random roads, and chaotic ones, are cut.
STUDIES: Mapping[str, Study] = {
    "active_quarter_car": Study("--t-end 4"),
    "active_vehicle": Study("--t-end 4"),
    "bouncing_ball": Study(),
    "cable_net": Study("--t-end 0.1", methods=MANY_BODIES, budget=240),
    "double_pendulum_on_shaking_base": Study(),
    "elastic_pendulum": Study(),
    "elastic_slider_crank": Study("--t-end 0.02 --output bending", methods=BOUND),
    "elastic_vehicle": Study("--t-end 4"),
    "four_bar": Study(methods=BOUND),
    "free_spinning_body": Study(),
    "gear_with_backlash": Study("--t-end 0.4", methods="generalized_alpha,generalized_alpha_adaptive,rk4,rk45"),
    "half_car_on_measured_road": Study("--t-end 4"),
    "hanging_chain": Study("--t-end 1"),
    "heavy_top": Study("--t-end 1 --output centre_of_mass", "joint_coordinates.toml"),
    "jerk_limited_arm": Study("--t-end 0.5"),
    "misaligned_four_bar": Study("--t-end 1 --output angles", methods=IMPLICIT, budget=150),
    "pendulum_on_shaking_base": Study(),
    "pi_servo": Study(),
    "quarter_car": Study("--t-end 4"),
    "quarter_car_on_bump": Study(),
    "rattleback": Study("--t-end 2 --output spin", methods=BOUND),
    "robot_arm": Study(),
    "sea_arm": Study("--t-end 0.5"),
    "shear_frame_with_pendulum": Study("--t-end 10", methods=f"{FREE},rosenbrock,lsrt2"),
    "slider_crank_planar": Study(methods=BOUND),
    "slider_crank_spatial": Study(methods=BOUND),
    "spherical_pendulum": Study(),
    "spin_up_beam": Study("--output tip_deflection"),
    "symmetric_top": Study(),
    "unbalanced_shaft": Study("--t-end 1.5 --output middle", methods=IMPLICIT),
}


def scene_of(name: str) -> str:
    """Return the path of an example's scene in the repository."""
    return f"examples/{name}/{STUDIES[name].file}"


def command(name: str) -> str:
    """Return the command that a page names."""
    return shlex.join(["eomgen", *_words_of(name), "--out", f"out/examples/{name}"])


def _words_of(name: str) -> list[str]:
    study = STUDIES[name]
    shared = f"{VARIED} --budget {study.budget} --repeats 9"
    return ["tradeoff", scene_of(name), *shlex.split(f"{study.options} --methods {study.methods} {shared}")]


def measure(name: str, folder: Path) -> None:
    """Run the command of a page, into a folder of its own in another one."""
    place = folder / name
    for kept in ("points.jsonl", "reference.npz"):
        (place / kept).unlink(missing_ok=True)
    _eomgen(*_words_of(name), "--out", str(place))


def study_in(folder: Path) -> Tradeoff:
    """Return the study that ``tradeoff.json`` in a folder tells. Raises ValueError where methods were not built in
    time, which the cache has at the next run."""
    from eomgen.studies import Point, Tradeoff  # noqa: PLC0415  # of a product

    held = json.loads((folder / "tradeoff.json").read_text(encoding="utf-8"))
    if late := [name for name, why in held["left_out"].items() if why.startswith("not built")]:
        raise ValueError(f"{folder.name}: {'; '.join(late)}: not built within the budget; run it once more")
    span = held["span"]
    return Tradeoff(
        held["scene"],
        held["quantity"],
        held["measure"],
        (span["start"], span["end"], span["rows"]),
        tuple(Point.from_dict(point) for point in held["points"]),
        held["reference"],
        held["machine"],
        seconds=held["seconds"],
    )


def section(name: str, study: Tradeoff, told: Mapping[str, Any]) -> str:
    """Return what stands between the marks of a page.

    Parameters
    ----------
    told : what ``eomgen info --json`` says of the scene
    """
    start, end, _ = study.span
    what = "the state" if study.quantity == "state" else f"`{study.quantity}`"
    machine = f"{study.machine['processor']}, {study.machine['compiler']}"
    lines = [
        "## Size",
        "",
        size(told),
        "",
        "## Speed against accuracy",
        "",
        f"    {command(name)}",
        "",
        f"![Time and error of the cheapest runs]({name}.png)",
        "",
        f"Largest relative errors of {what} over {end - start:.4g} s; {machine}.",
        "",
        "| demand | cheapest that meets it | step or tolerance | error | time |",
        "|---|---|---|---|---|",
    ]
    for demand in DEMANDS:
        best = study.best(demand)
        cells = ["none meets it", "", "", ""] if best is None else _cells(study, best)
        lines.append(f"| {power(demand)} | {' | '.join(cells)} |")
    lines += ["", own_settings(study)]
    by, bar = study.reference["by"], study.uncertainty
    lines += ["", f"The reference, {by}, is known to {bar:.0e} by {study.reference['held against']}."]
    return "\n".join(lines)


def size(told: Mapping[str, Any]) -> str:
    """Return the size of a scene's equations in words."""
    sizes, functions = told["sizes"], told["functions"]
    parts = [_counted(told["degrees_of_freedom"], "degree of freedom", "degrees of freedom")]
    parts.append(_counted(sizes["bodies"], "body", "bodies"))
    if told["constraints"]:
        parts.append(f"{_counted(sizes['nv'], 'velocity', 'velocities')} under {len(told['constraints'])} constraints")
    if sizes["nz"]:
        parts.append(_counted(sizes["nz"], "internal state", "internal states"))
    if sizes["nu"]:
        parts.append(_counted(sizes["nu"], "input", "inputs"))
    flops = [
        f"{title} {functions[key]['counts']['flops']}"
        for key, title in (
            ("mass", "inertia matrix"),
            ("inverse_dynamics", "inverse dynamics"),
            ("forward_dynamics", "forward dynamics"),
        )
        if key in functions
    ]
    return f"{', '.join(parts)}. Floating-point operations: {', '.join(flops)}."


def own_settings(study: Tradeoff) -> str:
    """Return a sentence on the scene's own settings."""
    own = study.points[0]
    if own.seconds is None:
        return f"The scene's own, {_words(own)}, does not reach the end: {own.said}."
    error = study.error(own)
    text = f"The scene's own settings, {_words(own)}, give {error:.1e} in {_time(own.seconds)}"
    best = study.best(error)
    if best is None or not best.seconds or own.seconds < 1.1 * best.seconds:
        return f"{text}; nothing is as accurate and faster."
    return f"{text}; {_words(best)} is as accurate and {own.seconds / best.seconds:.2g} times as fast."


def power(demand: float) -> str:
    """Return a power of ten as pages write it."""
    return f"1e{round(math.log10(demand))}"


def _cells(study: Tradeoff, point: Point) -> list[str]:
    resolution = f"{point.value:.4g}{' s' if point.kind == 'step' else ''}"
    return [point.configuration.label, resolution, f"{study.error(point):.1e}", _time(point.seconds)]


def _words(point: Point) -> str:
    """Return a configuration as keys of a scene, and what is unusual in it."""
    c = point.configuration
    parts = [f"`{c.method}`", *(f"{name} {value:g}" for name, value in c.parameters.items())]
    parts.append(f"step {point.value:.4g} s" if point.kind == "step" else f"tolerance {point.value:g}")
    parts += [c.formulation] if c.formulation not in ("joint", "as given") else []
    parts += [c.policy] if c.policy else []
    parts += [c.real] if c.real != "double" else []
    parts += [f"profile {c.profile}"] if c.profile != "fast" else []
    return ", ".join(parts)


def _time(seconds: float | None) -> str:
    if seconds is None:
        return ""
    unit, scale = next((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("µs", 0.0)) if seconds >= s)
    return f"{seconds / (scale or 1e-6):.3g} {unit}"


def _counted(count: int, one: str, several: str) -> str:
    return f"{count} {one if count == 1 else several}"


def row(name: str, study: Tradeoff, told: Mapping[str, Any]) -> str:
    """Return the row of an example in the table of all."""
    cells = [f"[{name}]({name}.md)", f"{told['description']}", str(told["degrees_of_freedom"])]
    cells.append(str(len(told["constraints"])))
    for demand in TOLD:
        best = study.best(demand)
        cells.append("none" if best is None else f"{_words(best)}, {_time(best.seconds)}")
    cells.append(f"{study.error(study.points[0]):.0e}")
    return f"| {' | '.join(cells)} |"


def write(name: str, folder: Path) -> None:
    """Write the measured part of an example's page, and its row in the table of all."""
    study = study_in(folder / name)
    told = json.loads(_eomgen("info", scene_of(name), "--json"))
    page, index = PAGES / f"{name}.md", PAGES / "README.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    page.write_text(f"{before}{BEGIN}\n\n{section(name, study, told)}\n\n{END}{after}", encoding="utf-8")
    table = index.read_text(encoding="utf-8")
    changed, count = re.subn(rf"^\| \[{name}\]\(.*$", lambda _: row(name, study, told), table, flags=re.MULTILINE)
    if count != 1:
        raise ValueError(f"{index}: {count} rows of {name}, not one")
    index.write_text(changed, encoding="utf-8")


def _eomgen(*words: str) -> str:
    """Return what eomgen prints."""
    ran = subprocess.run([sys.executable, "-m", "eomgen", *words], check=True, cwd=ROOT, stdout=subprocess.PIPE)
    return ran.stdout.decode("utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="folders of examples; all by default")
    parser.add_argument("--folder", type=Path, default=ROOT / "out" / "examples", help="of the studies")
    parser.add_argument("--keep", action="store_true", help="write from the studies that the folder holds")
    given = parser.parse_args(arguments)
    for name in given.names or STUDIES:
        if not given.keep:
            measure(name, given.folder)
        write(name, given.folder)


if __name__ == "__main__":
    main()
