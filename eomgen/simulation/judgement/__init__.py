"""Checks of a finished run, and remedies: energies, constraints, growth, fast motions, failures."""

#: Open to the other parts of ``simulation``.
WITHIN = ["diagnosis", "finished_run", "register", "starts"]

__all__ = [
    "beams",
    "diagnosis",
    "failures",
    "finished_run",
    "instability",
    "register",
    "singular_positions",
    "starts",
    "stated_errors",
]
