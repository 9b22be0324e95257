"""Names of attributes of the product robots in other programs, and the remedy, by class, for messages."""

from __future__ import annotations

ATTRIBUTES: dict[str, dict[str, str]] = {
    "": {
        **dict.fromkeys(("load_urdf", "from_urdf"), "load"),
        **dict.fromkeys(("buildModelFromUrdf", "buildModelFromMJCF", "parse_urdf", "urdf"), 'load("robot.urdf")'),
    },
}
