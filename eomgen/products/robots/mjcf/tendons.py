"""Tendons of MJCF: fixed ones, whose lengths are sums of coordinates, and spatial ones along paths of sites, which wrap
around geoms; springs and dampers along both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from eomgen.products.robots.mjcf.draft import MjcfDraft, clip, odd_power, plain_power, polynomial, times, total
from eomgen.products.robots.mjcf.equalities import site_place
from eomgen.products.robots.scene_draft import number


def convert_tendons(draft: MjcfDraft) -> None:
    """Add the tendons of a file: definitions of length and rate, and forces, as efforts on joints, or as tendons in the
    scene for spatial ones. A spatial tendon without force is noted."""
    model = draft.model
    driven = {
        int(target)
        for kind, (target, *_) in zip(model.actuator_trntype, model.actuator_trnid, strict=True)
        if kind == draft.mujoco.mjtTrn.mjTRN_TENDON
    }
    wrap_joint = int(draft.mujoco.mjtWrap.mjWRAP_JOINT)
    for index in range(model.ntendon):
        location = draft.place("tendon", index, model.ntendon)
        written = draft.element_name("tendon", index)
        first, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
        wraps = range(first, first + count)
        if int(model.wrap_type[first]) != wrap_joint:
            if _acts(draft, index) or index in driven:
                _spatial(draft, index, written)
            else:
                note = f"not modelled: the spatial tendon {written or index + 1}, which has no force [W0156]"
                draft.leave_out(location, note)
            continue
        draft.tendons[index] = _name(draft, index, written)
        draft.tendon_joints[index] = [(int(model.wrap_objid[k]), float(model.wrap_prm[k])) for k in wraps]
        joints = [(draft.joints[joint], coefficient) for joint, coefficient in draft.tendon_joints[index]]
        _add_measures(draft, index, ("q", "v"), joints)


def _name(draft: MjcfDraft, index: int, written: str) -> str:
    """Return a name for the length of a tendon; the rate has the same one with an ending."""
    name = draft.name("signal", "", f"length_of_{written or f'tendon_{index + 1}'}")
    draft.taken["signal"].add(f"{name}_rate")
    return name


def _add_measures(draft: MjcfDraft, index: int, words: tuple[str, str], parts: Sequence[tuple[str, float]]) -> None:
    """Add length and rate of a tendon as definitions, and spring and damper; report or note properties that no scene
    has. ``words`` are the quantities whose sums are length and rate, as ("q", "v"); ``parts`` are names with
    factors."""
    model, location = draft.model, draft.place("tendon", index, draft.model.ntendon)
    name = draft.tendons[index]
    for measure, word in zip((name, f"{name}_rate"), words, strict=True):
        terms = [times(factor, f"{word}.{part}") for part, factor in parts]
        draft.put("definitions", measure, {"formula": total(terms)}, location)
    if not add_armature(draft, index, float(model.tendon_armature[index])):
        fault = "armature of a tendon along several joints is not supported [E1928]"
        draft.refuse(location, f"tendon {name}", fault, "armature of its joints")
    if model.tendon_springyield[index]:
        fault = "springyield makes the spring plastic, and no scene has such springs [E1929]"
        draft.refuse(location, f"tendon {name}", fault, "springyield 0")
    if model.tendon_frictionloss[index] and not draft.is_disabled("FRICTIONLOSS"):
        draft.left_out("dry friction of tendons (frictionloss)", name)
    if model.tendon_limited[index] and not draft.is_disabled("LIMIT"):
        draft.left_out("limits of tendons (range)", name)
    stiffness = [float(model.tendon_stiffness[index]), *map(float, model.tendon_stiffnesspoly[index])]
    damping = [float(model.tendon_damping[index]), *map(float, model.tendon_dampingpoly[index])]
    terms = []
    if any(stiffness) and not draft.is_disabled("SPRING"):
        low, high = (float(value) for value in model.tendon_lengthspring[index])
        slack = number(low) if low == high else clip(name, low, high)
        terms.append(polynomial(f"({name} - {slack})", stiffness, plain_power))
    if any(damping) and not draft.is_disabled("DAMPER"):
        terms.append(polynomial(f"{name}_rate", damping, odd_power))
    draft.pulls[index] = []
    add_tension(draft, index, terms)


def add_tension(draft: MjcfDraft, index: int, terms: list[str]) -> None:
    """Add terms, N or N m, to the tension of a tendon: collected in ``pulls`` for a spatial tendon, and as efforts of
    its joints for a fixed one."""
    if index in draft.branches:
        draft.pulls[index] += terms
    elif terms:
        name = draft.tendons[index]
        tension = draft.define(f"tension_of_{name.removeprefix('length_of_')}", total(terms))
        for joint, coefficient in draft.tendon_joints[index]:
            effort = {"joint": draft.joints[joint], "effort": f"-({times(coefficient, tension)})"}
            draft.add("efforts", "effort", f"{tension}_on_{draft.joints[joint]}", effort)


def add_armature(draft: MjcfDraft, index: int, armature: float) -> bool:
    """Add the inertia of a tendon of one joint, kg or kg m^2, to the joint's rotor inertia; return False for an
    armature other than 0 on any other tendon."""
    joints = draft.tendon_joints.get(index, ())
    if armature and len(joints) == 1:
        joint, coefficient = joints[0]
        entry = draft.section("joints")[draft.joints[joint]]
        entry["rotor_inertia"] = entry.get("rotor_inertia", 0.0) + armature * coefficient**2
    return not armature or len(joints) == 1


def _acts(draft: MjcfDraft, index: int) -> bool:
    """Return whether a tendon has a spring, a damper, inertia or dry friction of its own."""
    model = draft.model
    names = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "armature", "frictionloss", "limited")
    return any(np.any(getattr(model, f"tendon_{name}")[index]) for name in names)


def _spatial(draft: MjcfDraft, index: int, written: str) -> None:
    """Add the branches of a spatial tendon (paths between pulleys) as tendons of the scene, and definitions of length
    and rate. ``written`` is the name in the file."""
    model, kinds = draft.model, draft.mujoco.mjtWrap
    location = draft.place("tendon", index, model.ntendon)
    first, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
    title = written or f"tendon_{index + 1}"
    name = _name(draft, index, written)
    branches: list[tuple[dict[str, Any], float]] = []
    divisor = 1.0
    entry: dict[str, Any] = {"points": []}
    for k in range(first, first + count):
        kind, target = int(model.wrap_type[k]), int(model.wrap_objid[k])
        if kind == kinds.mjWRAP_PULLEY:
            branches.append((entry, divisor))
            entry, divisor = {"points": []}, float(model.wrap_prm[k])
        elif kind == kinds.mjWRAP_SITE:
            entry["points"].append(_point(draft, target, entry["points"]))
        else:
            wrap = _obstacle(draft, index, title, k)
            if wrap is not None:
                entry.setdefault("wraps", []).append({"after": entry["points"][-1], **wrap})
    branches.append((entry, divisor))
    kept = [(entry, divisor) for entry, divisor in branches if len(entry["points"]) > 1]
    draft.branches[index] = []
    for number_of_branch, (entry, divisor) in enumerate(kept, 1):
        added = draft.add("tendons", "tendon", title if len(kept) == 1 else f"{title}_branch_{number_of_branch}", entry)
        draft.lines[f"tendons.{added}"] = str(location)
        draft.branches[index].append((added, divisor))
    draft.tendons[index] = name
    parts = [(branch, 1.0 / divisor) for branch, divisor in draft.branches[index]]
    _add_measures(draft, index, ("path_length", "path_rate"), parts)


def _point(draft: MjcfDraft, site: int, passed: Sequence[str] = ()) -> str:
    """Return the name of a point at a site, added once for each site; of a site among the points ``passed`` by a path
    another point is added."""
    if site not in draft.points or draft.points[site] in passed:
        written = draft.element_name("site", site) or f"site_{site + 1}"
        draft.points[site] = draft.add_point(f"at_{written}", site_place(draft, site))
    return draft.points[site]


def _obstacle(draft: MjcfDraft, index: int, title: str, k: int) -> dict[str, Any] | None:
    """Return the sphere or cylinder that a tendon wraps at number ``k`` of the model's wraps, as keys of a scene; None
    if the side site is on another body, which is reported. ``title`` names the tendon."""
    model = draft.model
    geom, side = int(model.wrap_objid[k]), round(float(model.wrap_prm[k]))
    at = draft.places[int(model.geom_bodyid[geom])].of(np.array(model.geom_pos[geom]), model.geom_quat[geom])
    cylinder = int(model.wrap_type[k]) == int(draft.mujoco.mjtWrap.mjWRAP_CYLINDER)
    center: dict[str, Any] = {"body": at.body, "position": at.position.tolist()}
    if cylinder:
        center |= {"axis": at.orientation[:, 2].tolist()}
    radius = float(model.geom_size[geom][0])
    entry: dict[str, Any] = {"shape": "cylinder" if cylinder else "sphere", "center": center, "radius": radius}
    if side >= 0:
        away = site_place(draft, side)
        if away.body != at.body:
            fault = f"the sidesite {draft.element_name('site', side)} is not on the body of its geom [E1930]"
            location = draft.place("tendon", index, model.ntendon)
            draft.refuse(location, f"tendon {title}", fault, "a site on the body of the geom")
            return None
        if float(np.linalg.norm(away.position - at.position)) < radius:
            entry["inside"] = True
        else:
            entry["side"] = _point(draft, side)
    return entry


def add_pulls(draft: MjcfDraft) -> None:
    """Set the forces of the branches of spatial tendons: the sum of the terms in ``pulls``, divided by the branch's
    divisor."""
    for index, branches in draft.branches.items():
        terms = draft.pulls[index]
        if not terms:
            continue
        tension = draft.define(f"tension_of_{draft.tendons[index].removeprefix('length_of_')}", total(terms))
        for branch, divisor in branches:
            draft.section("tendons")[branch]["force"] = times(1.0 / divisor, tension)
