"""What is wrong or doubtful of a run, and what to try: energies, constraints, growth, fast motions, failures."""

#: Open to the other parts of ``simulation``.
WITHIN = ["failed_step", "finished_run", "register", "start_checks", "turned_elements"]
