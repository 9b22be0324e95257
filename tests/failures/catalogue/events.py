"""Failures of events and modes."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("An event of a joint that is not there", 3, more='[events.stop]\nwhen = "q.sholder"\n'),
    Failure("An event that never passes zero", 3, more="[events.stop]\nwhen = 3\n"),
    Failure("An event of a comparison", 3, more='[events.stop]\nwhen = "q.shoulder < 0.5 and t > 1"\n'),
    Failure(
        "An event of a formula that nothing changes",
        4,
        command="info scene.toml",
        more='[events.stop]\nwhen = "0 * q.shoulder + 1"\n',
    ),
    Failure(
        "An impact by time alone",
        4,
        command="info scene.toml",
        more='[events.stop]\nwhen = "t - 1"\naction = "impact"\nrestitution = 0.5\n',
    ),
    Failure(
        "A negative restitution", 3, more='[events.stop]\nwhen = "q.shoulder"\naction = "impact"\nrestitution = -1\n'
    ),
    Failure(
        "An impact by velocities",
        4,
        command="info scene.toml",
        more='[events.stop]\nwhen = "v.shoulder - 1"\naction = "impact"\nrestitution = 0.5\n',
    ),
]
