"""Checks of a finished run, and remedies: energies, constraints, growth, fast motions, failures."""

#: Open to the other parts of ``simulation``.
WITHIN = ["diagnosis", "finished_run", "register", "start_checks"]

__all__ = ["remarks", "turned_elements"]
