"""Refused calls of fields from Python with their texts, and calls at the border that are taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import eomgen
from eomgen.products.fields.posteriors.mesh import Mesh
from eomgen.products.fields.posteriors.sampling import Sampler
from tests.failures.failure import invoked
from tests.hamiltonian.systems import OSCILLATOR


def sampler(**values: Any) -> Sampler:
    posterior = SimpleNamespace(mesh=Mesh((4,), 1.0), mass=lambda choice: None)
    return Sampler(cast(Any, posterior), **{"step": 0.1, "duration": 1.0, **values})


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "mesh of one cell": (
        lambda: Mesh((4, 1), 1.0),
        "Mesh: cells: (4, 1) is not a mesh; try: 1 to 3 numbers above 1: (64, 64)",
    ),
    "mesh of four axes": (
        lambda: Mesh((2, 2, 2, 2), 1.0),
        "Mesh: cells: (2, 2, 2, 2) is not a mesh; try: 1 to 3 numbers above 1: (64, 64)",
    ),
    "lengths of a mesh": (
        lambda: Mesh((4, 4), (1.0,)),
        "Mesh: lengths: (1.0,) are not 2 lengths from 1e-100 to 1e+100; try: one number, or one for each axis",
    ),
    "jitter": (lambda: sampler(jitter=1.0), "Sampler: jitter: 1 is invalid; try: from 0 to below 1"),
    "guard": (lambda: sampler(guard=0.0), "Sampler: guard: 0 is invalid; try: above 0 to 1, as 0.9, or inf for none"),
    "large guard": (
        lambda: sampler(guard=1.01),
        "Sampler: guard: 1.01 is invalid; try: above 0 to 1, as 0.9, or inf for none",
    ),
    "chains": (lambda: sampler(chains=0), "Sampler: chains: 0 is invalid; try: from 1 on"),
    "duration": (lambda: sampler(duration=0.0), "Sampler: duration: 0 is invalid; try: above 0"),
    "seed": (lambda: sampler(seed=-1), "Sampler: seed: -1 is invalid; try: from 0 to 9223372036854775807"),
    "first": (
        lambda: sampler(first="jump"),
        """Sampler: first: 'jump' is neither; try: "random", "drift" or "kick\"""",
    ),
}
ACCEPTED: Sequence[Callable[[], object]] = (lambda: Mesh((2,), 1.0),)


def objects_with_names() -> list[object]:
    """Return objects whose attributes have other names elsewhere."""
    oscillator = eomgen.build(OSCILLATOR)
    return [oscillator, oscillator.simulate(0.01, 1e-3)]


#: Readers of files: ending, call and exit code.
READERS: dict[str, tuple[str, Callable[[Path], object], int]] = {
    "field": (".toml", lambda path: invoked("sample", str(path), "--out", str(path.with_name("o"))), 7),
}
