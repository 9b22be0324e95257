"""Checks of a finished run, and remedies: energies, constraints, growth, fast motions, failures."""

#: Open to the other parts of ``simulation``.
WITHIN = ["failed_step", "finished_run", "register", "start_checks"]

__all__ = ["turned_elements"]
