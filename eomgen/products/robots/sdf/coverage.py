"""How each element and attribute of SDF is taken: a table by element.

An attribute has an ``@`` before its name. All parts of an element without effect are without effect, and all parts of a
noted element are noted with the element. The rows are the elements of all versions of the format that are read.
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
_ADDED_MASS = "xx xy xz xp xq xr yy yz yp yq yr zz zp zq zr pp pq pr qq qr rr"
#: By key of an element: children and attributes by status.
_ROWS: Mapping[str, Mapping[str, str]] = {
    "sdf": {READ: "@version world model", IDLE: "light", NOTED: "actor"},
    "world": {
        READ: "@name gravity include frame model joint physics",
        IDLE: "audio magnetic_field atmosphere gui scene light road spherical_coordinates",
        NOTED: "wind actor plugin state population",
    },
    "world/physics": {
        READ: "gravity",
        IDLE: (
            "@default @name @type bullet dart magnetic_field max_contacts max_step_size ode real_time_factor"
            " real_time_update_rate simbody"
        ),
    },
    "include": {READ: "@merge uri name static pose placement_frame", IDLE: "namespace", NOTED: "plugin model_state"},
    "model": {
        READ: "@name @canonical_link @placement_frame static pose frame link joint model include",
        IDLE: "@namespace self_collide allow_auto_disable",
        NOTED: "plugin gripper enable_wind model_state",
    },
    "frame": {READ: "@name @attached_to pose"},
    "pose": {READ: "@relative_to @degrees @rotation_format @frame"},
    "link": {
        READ: "@name gravity pose inertial visual",
        IDLE: (
            "collision self_collide must_be_base_link projector audio_sink audio_source light particle_emitter battery"
        ),
        NOTED: "enable_wind velocity_decay sensor frame",
        REFUSED: "kinematic",
    },
    "velocity_decay": {NOTED: "linear angular"},
    "inertial": {
        READ: "mass pose inertia",
        IDLE: "density auto_inertia_params",
        NOTED: "frame",
        REFUSED: "@auto fluid_added_mass",
    },
    "inertial/pose": {READ: "@degrees @rotation_format", REFUSED: "@relative_to @frame"},
    "fluid_added_mass": {REFUSED: _ADDED_MASS},
    "inertia": {READ: "ixx ixy ixz iyy iyz izz"},
    "joint": {
        READ: (
            "@name @type parent child pose gearbox_ratio gearbox_reference_body thread_pitch screw_thread_pitch"
            " axis axis2 physics"
        ),
        NOTED: "sensor frame",
    },
    "axis": _AXIS,
    "axis2": _AXIS,
    "xyz": {READ: "@expressed_in"},
    "dynamics": {READ: "damping friction spring_reference spring_stiffness"},
    "limit": {READ: "lower upper effort stiffness dissipation", NOTED: "velocity"},
    "mimic": {READ: "@joint @axis multiplier offset reference"},
    "joint/physics": {READ: "simbody", IDLE: "ode provide_feedback"},
    "simbody": {READ: "must_be_loop_joint"},
}  # fmt: skip
#: Status by child or attribute, of each element.
STATUSES: Mapping[str, Mapping[str, str]] = {
    key: {name: status for status, names in by_status.items() for name in names.split()}
    for key, by_status in _ROWS.items()
}
