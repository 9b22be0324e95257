"""Fixed tendons of MJCF: lengths that are sums of coordinates, with springs and dampers along them."""

from __future__ import annotations

from eomgen.scene.sources.mjcf.draft import (
    Draft,
    clipped,
    number,
    odd_power,
    plain_power,
    polynomial,
    times,
    total,
)


def convert_tendons(draft: Draft) -> None:
    """Add the fixed tendons of a file as definitions of length and rate, and their forces as efforts."""
    model = draft.model
    wrap_joint = int(draft.mujoco.mjtWrap.mjWRAP_JOINT)
    for index in range(model.ntendon):
        place = draft.place("tendon", index, model.ntendon)
        written = draft.written("tendon", index)
        first, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
        wraps = range(first, first + count)
        if int(model.wrap_type[first]) != wrap_joint:
            _left_or_refused(draft, index, written or f"tendon {index + 1}")
            continue
        name = draft.name("signal", "", f"length_of_{written or f'tendon_{index + 1}'}")
        draft.taken["signal"].add(f"{name}_rate")
        draft.tendons[index] = name
        draft.tendon_joints[index] = [(int(model.wrap_objid[k]), float(model.wrap_prm[k])) for k in wraps]
        for own, letter in ((name, "q"), (f"{name}_rate", "v")):
            terms = [times(c, f"{letter}.{draft.joints[joint]}") for joint, c in draft.tendon_joints[index]]
            draft.section("definitions")[own] = {"formula": total(terms)}
            draft.lines[f"definitions.{own}"] = str(place)
        _forces(draft, index, name)


def _forces(draft: Draft, index: int, name: str) -> None:
    model, place = draft.model, draft.place("tendon", index, draft.model.ntendon)
    if model.tendon_armature[index]:
        draft.refuse(place, f"tendon {name}", "a tendon with armature is not supported", "armature of its joints")
    if model.tendon_springyield[index]:
        draft.refuse(
            place,
            f"tendon {name}",
            "springyield makes the spring plastic, and no scene has such springs",
            "springyield 0",
        )
    if model.tendon_frictionloss[index] and not draft.disabled("FRICTIONLOSS"):
        draft.left_out("dry friction of tendons (frictionloss)", name)
    if model.tendon_limited[index] and not draft.disabled("LIMIT"):
        draft.left_out("limits of tendons (range)", name)
    if model.tendon_actfrclimited[index]:
        draft.refuse(
            place, f"tendon {name}", "actuatorfrcrange of a tendon is not supported", "forcerange of its actuator"
        )
    stiffness = [float(model.tendon_stiffness[index]), *map(float, model.tendon_stiffnesspoly[index])]
    damping = [float(model.tendon_damping[index]), *map(float, model.tendon_dampingpoly[index])]
    terms = []
    if any(stiffness) and not draft.disabled("SPRING"):
        low, high = (float(value) for value in model.tendon_lengthspring[index])
        slack = number(low) if low == high else clipped(name, low, high)
        terms.append(polynomial(f"({name} - {slack})", stiffness, plain_power))
    if any(damping) and not draft.disabled("DAMPER"):
        terms.append(polynomial(f"{name}_rate", damping, odd_power))
    if terms:
        tension = draft.name("signal", "", name.replace("length_of_", "tension_of_", 1))
        draft.section("definitions")[tension] = {"formula": total(terms)}
        for joint, coefficient in draft.tendon_joints[index]:
            own = draft.name("effort", "", f"{tension}_on_{draft.joints[joint]}")
            draft.section("efforts")[own] = {
                "joint": draft.joints[joint],
                "effort": f"-({times(coefficient, tension)})",
            }


def _left_or_refused(draft: Draft, index: int, name: str) -> None:
    """Refuse a spatial tendon with forces of its own; its actuators and equalities are refused by their sections."""
    model, place = draft.model, draft.place("tendon", index, draft.model.ntendon)
    spring = [model.tendon_stiffness[index], *model.tendon_stiffnesspoly[index]]
    damper = [model.tendon_damping[index], *model.tendon_dampingpoly[index]]
    if any(spring) or any(damper) or model.tendon_armature[index]:
        fault = "a spatial tendon with stiffness, damping or armature is not supported"
        draft.refuse(place, f"tendon {name}", fault, "springs of a scene that includes the file")
    else:
        draft.leave_out(place, f"not modelled: the spatial tendon {name}")
