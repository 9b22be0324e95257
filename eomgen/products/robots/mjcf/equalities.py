"""Equalities of MJCF as exact constraints: MuJoCo holds them by forces that give way."""

from __future__ import annotations

import numpy as np

from eomgen.products.robots.mjcf.draft import MjcfDraft, plain_power, polynomial
from eomgen.products.robots.mjcf.tree import HINGE
from eomgen.products.robots.scene_draft import LinkPlace, number


def convert_equalities(draft: MjcfDraft) -> None:
    """Add the active equalities of a file to the scene as exact constraints, unless the file switches all off; note
    inactive ones, and report kinds that no scene has."""
    model, kinds = draft.model, draft.mujoco.mjtEq
    if draft.is_disabled("EQUALITY"):
        return
    for index in range(model.neq):
        location = draft.place("equality", index, model.neq)
        written = draft.element_name("equality", index)
        kind = int(model.eq_type[index])
        word = kinds(kind).name.removeprefix("mjEQ_").lower()
        name = draft.name("constraint", written, f"{word}_{index + 1}")
        draft.lines[f"constraints.{name}"] = str(location)
        if not model.eq_active0[index]:
            draft.leave_out(location, f"not modelled: the equality {name}, which the file makes inactive [W0154]")
        elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            _join(draft, index, name, welded=kind == kinds.mjEQ_WELD)
        elif kind == kinds.mjEQ_JOINT:
            variables = [f"q.{draft.joints[joint]}" for joint in _objects(draft, index)]
            turning = int(model.jnt_type[_objects(draft, index)[0]]) == HINGE
            zeros = [float(model.qpos0[model.jnt_qposadr[joint]]) for joint in _objects(draft, index)]
            _couple(draft, index, name, variables, zeros, "rad" if turning else "m")
        elif kind == kinds.mjEQ_TENDON and all(tendon in draft.tendon_joints for tendon in _objects(draft, index)):
            lengths = [draft.tendons[tendon] for tendon in _objects(draft, index)]
            zeros = [float(model.tendon_length0[tendon]) for tendon in _objects(draft, index)]
            joints = [joint for joint, _ in draft.tendon_joints[_objects(draft, index)[0]]]
            turning = all(int(model.jnt_type[joint]) == HINGE for joint in joints)
            _couple(draft, index, name, lengths, zeros, "rad" if turning else "m")
        else:
            kind_of = "a spatial tendon" if word == "tendon" else f"type {word}"
            fault = f"an equality of {kind_of} is not supported [E1927]"
            draft.refuse(location, f"constraints.{name}", fault, 'connect, weld or joint; or active="false"')


def _objects(draft: MjcfDraft, index: int) -> list[int]:
    """Return the objects of an equality, one or two."""
    both = [int(draft.model.eq_obj1id[index]), int(draft.model.eq_obj2id[index])]
    return [number for number in both if number >= 0]


def site_place(draft: MjcfDraft, site: int) -> LinkPlace:
    """Return the pose of a site."""
    body = draft.places[int(draft.model.site_bodyid[site])]
    return body.of(np.array(draft.model.site_pos[site]), draft.model.site_quat[site])


def _join(draft: MjcfDraft, index: int, name: str, *, welded: bool) -> None:
    """Add a spherical constraint between two frames, or a fixed one for ``welded``; an equality within one body is
    noted, since MuJoCo's forces do not move the body either."""
    model = draft.model
    first, second = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
    anchor, mate, quaternion = (np.array(model.eq_data[index][part]) for part in (slice(3), slice(3, 6), slice(6, 10)))
    if int(model.eq_objtype[index]) == int(draft.mujoco.mjtObj.mjOBJ_SITE):
        places = [site_place(draft, first), site_place(draft, second)]
    elif welded:
        places = [draft.places[first].of(mate, quaternion), draft.places[second].of(anchor)]
    else:
        places = [draft.places[first].of(anchor), draft.places[second].of(mate)]
    if places[0].body == places[1].body:
        draft.notes.append(f"the equality {name} is left out: both ends are on one body [W0270]")
        return
    draft.constrain(name, "fixed" if welded else "spherical", places)


def _couple(draft: MjcfDraft, index: int, name: str, variables: list[str], zeros: list[float], unit: str) -> None:
    """Add the equation y - y0 = a0 + a1 (x - x0) + ... of an equality between coordinates, or lengths of tendons.
    ``variables`` are formulas of y and perhaps x, ``zeros`` y0 and x0, in ``unit``; the coefficients are the
    model's."""
    coefficients = [float(value) for value in draft.model.eq_data[index][:5]]
    right = number(coefficients[0] + zeros[0])
    if len(variables) == 2 and any(coefficients[1:]):
        leader = variables[1] if zeros[1] == 0.0 else f"({variables[1]} - {number(zeros[1])})"
        right += f" + {polynomial(leader, coefficients[1:], plain_power)}"
    entry = {"type": "formula", "equation": f"{variables[0]} - ({right})", "unit": unit}
    draft.section("constraints")[name] = entry
