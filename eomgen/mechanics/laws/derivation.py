"""The laws by name, and the module of laws derived by SymPy: ``python -m eomgen.mechanics.laws.derivation
eomgen/mechanics/laws/derived.py``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from eomgen.mechanics.laws import beams, contacts, quaternions, rigid_bodies
from eomgen.symbolic.kernel import Kernel

COMMAND = "python -m eomgen.mechanics.laws.derivation eomgen/mechanics/laws/derived.py"
DERIVATIONS: Mapping[str, Callable[[], Kernel]] = {
    "rotation_of_quaternion": quaternions.rotation,
    "virtual_work_of_rigid_body": rigid_bodies.virtual_work,
    "regressor_of_rigid_body": rigid_bodies.regressor,
    "kinetic_energy_of_rigid_body": rigid_bodies.kinetic_energy,
    "virtual_work_of_relative_motion": beams.relative_motion,
    "virtual_work_along_elastic_coordinate": beams.elastic_row,
    "kinetic_energy_of_relative_motion": beams.relative_energy,
    "onset_of_contact": contacts.onset,
}
_HEAD = f'''"""Laws derived by SymPy, so that no build imports it: written by
``{COMMAND}``."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel

LAWS: Mapping[str, Kernel] = {{
'''
_WIDTH = 120


def module() -> str:
    """Return the text of the module of all laws."""
    text = _HEAD
    for name, derive in DERIVATIONS.items():
        kernel = derive()
        steps = _lines(f"{_tuple(map(_quoted, step))}," for step in kernel.steps)
        results = _tuple(map(str, kernel.results))
        text += f'    "{name}": Kernel(\n        (\n{steps}        ),\n        {results},\n    ),\n'
    return text + "}\n"


def _quoted(entry: str | float) -> str:
    return f'"{entry}"' if isinstance(entry, str) else repr(entry)


def _tuple(entries: Iterable[str]) -> str:
    """Return Python's text of a tuple."""
    listed = list(entries)
    return f"({', '.join(listed)}{',' * (len(listed) == 1)})"


def _lines(items: Iterable[str]) -> str:
    """Return items side by side, as many to a line as it holds."""
    lines, indent = [""], " " * 12
    for item in items:
        if lines[-1] and len(indent) + len(lines[-1]) + 1 + len(item) > _WIDTH:
            lines.append("")
        lines[-1] += f" {item}" if lines[-1] else item
    return "".join(f"{indent}{line}\n" for line in lines)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(module(), encoding="utf-8")
