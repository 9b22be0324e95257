"""How each element and attribute of SDF is taken: a table by element.

An attribute has an ``@`` before its name. All parts of an element without effect are without effect, and all parts of a
noted element are noted with the element.
"""

from __future__ import annotations

from collections.abc import Mapping

READ, IDLE, NOTED, REFUSED = "read", "without effect", "noted", "refused"
#: Meaning of each status.
MEANINGS: Mapping[str, str] = {
    READ: "takes part in the equations, the names, the start or the pictures",
    IDLE: "pictures, contact, sound, or the numbers of solvers: no part of the equations; counted in a note",
    NOTED: "left out with a note if it would act; refused with `--strict`",
    REFUSED: "refused with file and line if it would act",
}
_AXIS = {READ: "xyz dynamics limit mimic use_parent_model_frame", NOTED: "initial_position"}
#: By key of an element: children and attributes by status.
_ROWS: Mapping[str, Mapping[str, str]] = {
    "sdf": {READ: "@version world model", IDLE: "light", NOTED: "actor"},
    "world": {
        READ: "@name gravity include frame model joint",
        IDLE: "audio magnetic_field atmosphere gui physics scene light road spherical_coordinates",
        NOTED: "wind actor plugin state population",
    },
    "include": {READ: "@merge uri name static pose placement_frame", IDLE: "namespace", NOTED: "plugin"},
    "model": {
        READ: "@name @canonical_link @placement_frame static pose frame link joint model include",
        IDLE: "@namespace self_collide allow_auto_disable",
        NOTED: "plugin gripper enable_wind",
    },
    "frame": {READ: "@name @attached_to pose"},
    "pose": {READ: "@relative_to @degrees @rotation_format @frame"},
    "link": {
        READ: "@name gravity pose inertial visual",
        IDLE: (
            "collision self_collide must_be_base_link projector audio_sink audio_source light particle_emitter battery"
        ),
        NOTED: "enable_wind velocity_decay sensor",
        REFUSED: "kinematic",
    },
    "inertial": {
        READ: "mass pose inertia",
        IDLE: "density auto_inertia_params",
        REFUSED: "@auto fluid_added_mass",
    },
    "inertia": {READ: "ixx ixy ixz iyy iyz izz"},
    "joint": {
        READ: (
            "@name @type parent child pose gearbox_ratio gearbox_reference_body thread_pitch screw_thread_pitch"
            " axis axis2 physics"
        ),
        NOTED: "sensor",
    },
    "axis": _AXIS,
    "axis2": _AXIS,
    "xyz": {READ: "@expressed_in"},
    "dynamics": {READ: "damping friction spring_reference spring_stiffness"},
    "limit": {READ: "lower upper effort velocity stiffness dissipation"},
    "mimic": {READ: "@joint @axis multiplier offset reference"},
    "physics": {READ: "simbody", IDLE: "ode provide_feedback"},
    "simbody": {READ: "must_be_loop_joint"},
}  # fmt: skip
#: Status by child or attribute, of each element.
STATUSES: Mapping[str, Mapping[str, str]] = {
    key: {name: status for status, names in by_status.items() for name in names.split()}
    for key, by_status in _ROWS.items()
}
