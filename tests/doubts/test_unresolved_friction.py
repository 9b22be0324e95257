"""Friction that no step resolves is told by a run and by its file."""

from __future__ import annotations

import pickle

import eomgen
from tests.models.doubtful_scenes import UNRESOLVED, stuck


def test_friction_that_steps_do_not_resolve_is_told_by_runs_and_their_files() -> None:
    run = eomgen.build(stuck(), profile="quick").simulate()
    assert UNRESOLVED in run.message and UNRESOLVED in str(pickle.loads(pickle.dumps(run)).message)
