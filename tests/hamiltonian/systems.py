"""Data of Hamiltonian systems that tests share."""

from __future__ import annotations

from typing import Any


def system(name: str, hamiltonian: str | dict[str, str], **sections: Any) -> Any:
    """Return the data of a system; the first run is as in ``sections["simulation"]``."""
    return {"format": 1, "kind": "hamiltonian", "name": name, "hamiltonian": hamiltonian, **sections}


#: A mass of 1 kg on a spring of 1 N/m.
OSCILLATOR = system(
    "oscillator",
    "p_x**2/2 + x**2/2",
    coordinates={"x": {"initial": [1.0, 0.0]}},
    simulation={"duration": 20.0, "step": 0.1},
)
