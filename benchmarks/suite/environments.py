"""Virtual environments of the contestants, below ``.bench``: one for each group of peers that agree on versions.

    python -m benchmarks.suite.environments [GROUP ...]    those of `make bench`, if none is named

Needs no package but pip's: it runs before anything is installed. A peer that does not install keeps its reason, which
the rows that wanted it show.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / ".bench"
OWN, JAX, ADAM, PEERS = "eomgen", "jax", "adam", "peers"
#: What is installed in each; eomgen's own scripts import the peers of its group.
GROUPS: Mapping[str, Sequence[str]] = {
    OWN: (
        f"--editable={ROOT}", "pin>=3", "cmeel-eigen>=3.4", "example-robot-data>=4", "casadi>=3.6", "exudyn>=1.9",
        "mujoco>=3", "heyoka>=7", "scikit-sundae>=1.2", "pyelastica>=1", "pydy>=0.7", "cython>=3",
        "distributed>=2024.5", "jax>=0.5", "drake>=1.40",
    ),
    JAX: ("jax>=0.4.35", "mujoco-mjx>=3.2", "diffrax>=0.6", "frax>=0.1"),
    ADAM: ("adam-robotics>=0.4", "jax>=0.4.30,<0.4.37"),  # its arrays ask for devices as older JAX names them
    PEERS: (  # of `make peers`; the templates of ROSS are of an older Plotly
        f"--editable={ROOT}", "pin>=3", "mujoco>=4", "exudyn>=1.13", "drake>=1.40", "bsk>=2.8", "ross-rotordynamics>=2",
        "plotly<7", "pybmodes>=1.19",
    ),
}  # fmt: skip  # a table


def interpreter(group: str, here: bool = False) -> Path:
    """Return the Python of a group; with ``here`` the one that runs this, whatever it has."""
    return Path(sys.executable) if here else FOLDER / group / "bin" / "python"


def reasons(group: str) -> dict[str, str]:
    """Return why packages of a group are not there, by requirement."""
    stamp = FOLDER / group / "installed.json"
    if not stamp.exists():
        return {}
    found: dict[str, str] = json.loads(stamp.read_text(encoding="utf-8"))
    return {requirement: reason for requirement, reason in found.items() if reason}


def install(group: str) -> dict[str, str]:
    """Install what a group lacks and return why what is missing is missing, by requirement."""
    wanted, stamp = GROUPS[group], FOLDER / group / "installed.json"
    if stamp.exists() and list(json.loads(stamp.read_text(encoding="utf-8"))) == list(wanted):
        return reasons(group)
    python = interpreter(group)
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(FOLDER / group)], check=True)
    outcome = dict.fromkeys(wanted, "")
    if _pip(python, wanted):  # not all of them together: each by itself
        outcome = {requirement: _pip(python, [requirement]) for requirement in wanted}
    stamp.write_text(json.dumps(outcome, indent=1) + "\n", encoding="utf-8")
    return reasons(group)


def _pip(python: Path, requirements: Sequence[str]) -> str:
    """Install requirements; return pip's last word where it fails."""
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *requirements]
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=alone)
    if not result.returncode:
        return ""
    lines = [line for line in result.stderr.splitlines() if line.startswith("ERROR")] or ["pip failed"]
    return lines[-1].removeprefix("ERROR: ")


def main() -> int:
    groups = sys.argv[1:] or [OWN, JAX, ADAM]
    for group in groups:
        print(f"peers: .bench/{group}", flush=True)
        for requirement, reason in install(group).items():
            print(f"  {requirement} is missing: {reason}")
    if any(f"--editable={ROOT}" in reasons(group) for group in groups):
        print("eomgen itself is not installed: nothing can be measured", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
