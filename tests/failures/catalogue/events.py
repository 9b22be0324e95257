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
        "A reset without values",
        3,
        "description error: scene.toml:33 (events.stop): the action reset needs the key reset; try: "
        'reset = {"v.joint"=0} [E1418]',
        more='[events.stop]\nwhen = "q.shoulder"\naction = "reset"\n',
    ),
    Failure(
        "A reset of an acceleration",
        3,
        "description error: scene.toml:36 (events.stop.reset.'a.shoulder'): a.shoulder cannot be used "
        'here (column 1); try: coordinates, velocities and internal states: "q.joint", "v.joint" only [E1556]',
        more='[events.stop]\nwhen = "q.shoulder"\naction = "reset"\nreset = { "a.shoulder" = 0 }\n',
    ),
    Failure(
        "A restitution of an event without impact",
        3,
        "description error: scene.toml:35 (events.stop.restitution): restitution has no meaning for record; "
        "try: action = impact [E1417]",
        more='[events.stop]\nwhen = "q.shoulder"\nrestitution = 0.5\n',
    ),
    Failure(
        "A negative restitution", 3, more='[events.stop]\nwhen = "q.shoulder"\naction = "impact"\nrestitution = -1\n'
    ),
    Failure(
        "An event that switches no mode",
        3,
        "description error: scene.toml:36 (events.stop.mode): there is no mode 'gear'; try: a [modes] section [E0100]",
        more='[events.stop]\nwhen = "t - 1"\naction = "switch"\nmode = "gear"\nto = 2\n',
    ),
    Failure(
        "An impact by velocities",
        4,
        command="info scene.toml",
        more='[events.stop]\nwhen = "v.shoulder - 1"\naction = "impact"\nrestitution = 0.5\n',
    ),
    Failure(
        "A unit of another kind for an interval",
        3,
        "description error: scene.toml:35 (events.stop.least_interval): '1 mm' is a length, a time in s "
        'is expected; try: "0.001 s" [E0303]',
        more='[events.stop]\nwhen = "q.shoulder"\nleast_interval = "1 mm"\n',
    ),
]
