"""Processor seconds from large files to what is asked of them, in new processes with an empty cache: reading of MJCF
with many humanoids and of an SDF world of many shapes, linear model of a blade of constrained elements by tables.

    python -m benchmarks.large_files [--cases blade humanoids shapes] [--quick]

Limits are those that changes have to keep.
"""

from __future__ import annotations

import argparse
import math
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.measure import environment_of_users, machine, table

#: By case: ending of the file, the number of parts, the same for ``--quick``, and the limit in seconds.
CASES = {"blade": (".toml", 20, 2, 6.0), "humanoids": (".xml", 100, 2, 10.0), "shapes": (".sdf", 3000, 20, 3.0)}
_READ = "import eomgen, sys; eomgen.load(sys.argv[1])"
_LIMB = '<body pos="0 0 -.3"><joint axis="0 1 0"/>{geom}<body pos="0 0 -.3"><joint axis="0 1 0"/>{geom}</body></body>'
_GEOM = '<geom type="capsule" fromto="0 0 0 0 0 -.3" size=".05"/>'


def blade(elements: int) -> str:
    """Return a cantilever whose sections are tables of 49 rows."""
    places = [k / 48 for k in range(49)]
    curves = {
        "mass": [680.0 * math.exp(-3.0 * s) * (1.0 + 0.1 * math.sin(40.0 * s)) for s in places],
        "flap": [1.8e10 * math.exp(-9.0 * s) for s in places],
        "edge": [1.8e10 * math.exp(-6.0 * s) for s in places],
    }
    lines = [
        'format = 1\nname = "blade"\n[beams.blade]\nmodel = "kirchhoff"\nlength = 60',
        f'elements = {elements}\nmass_per_length = "mass(s)"',
        'rotary_inertia = ["0.2 * mass(s)", "0.1 * mass(s)", "0.1 * mass(s)"]\npretwist = "0.2 * s"',
        'stiffness = { stretch = "10 * edge(s)", torsion = "flap(s)", bending_y = "flap(s)", bending_z = "edge(s)" }',
        '[joints.root]\ntype = "fixed"\nparent = "base"\nchild = "blade"',
    ]
    for name, values in curves.items():
        points = ", ".join(f"[{s!r}, {value!r}]" for s, value in zip(places, values, strict=True))
        lines.append(f'[curves.{name}]\ninterpolation = "linear"\npoints = [{points}]')
    return "\n".join(lines)


def humanoids(count: int) -> str:
    """Return MJCF of bodies with a free joint, four limbs of two links each and a head."""
    limbs = "".join(_LIMB.format(geom=_GEOM) for _ in range(4))
    body = f'<freejoint/><geom type="box" size=".1 .2 .3"/><geom type="sphere" pos="0 0 .4" size=".1"/>{limbs}'
    bodies = "".join(f'<body pos="{k} 0 1">{body}</body>' for k in range(count))
    return f'<mujoco model="crowd"><worldbody>{bodies}</worldbody></mujoco>'


def shapes(count: int) -> str:
    """Return an SDF world of a box that falls among static ones."""
    box = "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual>"
    inertia = "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>"
    models = "".join(
        f"<model name='m{k}'><static>true</static><pose>{k} 0 0 0 0 0</pose><link name='l'>{box}</link></model>"
        for k in range(count - 1)
    )
    falling = f"<model name='falling'><link name='l'>{inertia}{box}</link></model>"
    return f"<sdf version='1.9'><world name='w'>{models}{falling}</world></sdf>"


_TEXTS: dict[str, Callable[[int], str]] = {"blade": blade, "humanoids": humanoids, "shapes": shapes}


def seconds_of(case: str, parts: int) -> float:
    """Return processor seconds of a new process and of its compilers, with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{case}{CASES[case][0]}"
        file.write_text(_TEXTS[case](parts), encoding="utf-8")
        verb = ["-m", "eomgen", "linearize", str(file)] if case == "blade" else ["-c", _READ, str(file)]
        environment = environment_of_users(Path(folder) / "cache")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ran = subprocess.run(
            [sys.executable, *verb], capture_output=True, text=True, check=False, env={**os.environ, **environment}
        )
        if ran.returncode:
            raise RuntimeError(ran.stderr)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.large_files", description=(__doc__ or "").partition("\n\n")[0]
    )
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--quick", action="store_true", help="small files")
    arguments = parser.parse_args(words)
    print(machine())
    rows = []
    for case in arguments.cases:
        _, parts, few, limit = CASES[case]
        count = few if arguments.quick else parts
        rows.append([case, str(count), f"{seconds_of(case, count):.1f}", "" if arguments.quick else f"{limit:.0f}"])
    print(table(["case", "parts", "s", "limit"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
