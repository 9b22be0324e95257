"""What is wrong or doubtful of a run, and what to try: energies, constraints, growth, fast motions, failures."""

#: Open to the other parts of ``simulation``.
WITHIN = [
    "constraint_violation",
    "diagnosis",
    "doubtful_calls",
    "end_message",
    "energy_balance",
    "failed_step",
    "fast_laws",
    "fast_motions",
    "impact_starts",
    "instability",
    "momentum",
    "motion_between_rows",
    "singular_positions",
    "spring_lengths",
    "turned_elements",
    "unbounded_growth",
    "unit_quaternions",
    "warnings",
]
