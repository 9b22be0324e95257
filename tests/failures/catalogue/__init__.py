"""The failure catalogue: bad inputs by chapter, each with its exit code and its exact message.

A new entry needs no test of its own: put a ``Failure`` into its chapter, run ``python -m tests.messages``, and read
whether its answer in ``eomgen/base/message_examples.txt`` has place, fault, reason and remedy. An entry without a new
code, or too long for an example, has its message in the entry.
"""

from __future__ import annotations

from tests.failures.catalogue import (
    beams,
    command_lines,
    descriptions,
    environments,
    events,
    feedback,
    formulas,
    includes,
    linear_models,
    machines,
    names,
    robots,
    states,
    tables,
    units,
)
from tests.failures.failure import Failure

#: Title, first sentence and entries of each chapter.
CHAPTERS: list[tuple[str, str, list[Failure]]] = [
    ("Scene files", "Files that cannot be read, or that are not well formed.", descriptions.FAILURES),
    ("Machines", "Scenes that are well formed and describe no machine.", machines.FAILURES),
    ("Formulas", "Formulas are read by a small grammar of their own; nothing in them is ever run.", formulas.FAILURES),
    ("Names", "Names reach C, file names and terminals, so few characters are taken.", names.FAILURES),
    ("Units", "Numbers with units whose dimension does not fit, or that could be read in two ways.", units.FAILURES),
    ("Tables and curves", "CSV files and points.", tables.FAILURES),
    ("Included files", "Scenes made of several files.", includes.FAILURES),
    ("Internal states and controllers", "What has a memory: states by formula, controllers, filters.", states.FAILURES),
    ("Events", "Events and modes: formulas that have no roots, and actions that cannot be taken.", events.FAILURES),
    ("Feedback", "State feedback, calibrations that find no gains, skyhook.", feedback.FAILURES),
    ("Beams", "Elastic beams that cannot be, or whose shape functions do not suit what carries them.", beams.FAILURES),
    ("URDF", "Robots in the format of ROS.", robots.FAILURES),
    ("Linear models", "Modes, stability, roots and responses on the command line.", linear_models.FAILURES),
    ("Command lines", "Verbs, options, and files that they name.", command_lines.FAILURES),
    ("Environments", "Compilers, caches, disks, and runs that leave the numbers.", environments.FAILURES),
]
