"""Forces of contacts on both bodies at the contact point, equal and opposite, with the potential of elastic parts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from eomgen.mechanics.forces.frame_pairs import frame_pair
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Offer, Quantities
from eomgen.products.contacts import friction_laws, normal_laws
from eomgen.products.contacts.laws import LOCAL_NAMES, AppliedLaw, ContactLaw, state_name
from eomgen.products.contacts.pair import PairMotion
from eomgen.products.contacts.section import OF_LAWS, STATES, Contact
from eomgen.products.contacts.slip_laws import OF_FILE
from eomgen.symbolic.scalar import Scalar, apply, cross, dot, minus, plus, scaled, transpose
from eomgen.system.description import WORLD

#: Results of tangential laws, each 0 in a law without it.
_RESULTS = ("force_x", "force_y", *OF_LAWS)


class ContactForces:
    """Motion and forces of a contact on the tape, each recorded at the first use."""

    def __init__(self, quantities: Quantities, item: Contact) -> None:
        self._quantities, self._item = quantities, item
        self.motion = PairMotion(quantities, item, frame_pair(quantities, item.first, item.second))
        self.local, self.place = self.motion.local, self.motion.place

    def _record(self, law: ContactLaw, applied: AppliedLaw, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        keys = {name: self._quantities.formula(value) for name, value in applied.values.items()}
        return law.record(self._quantities.algebra, {**known, **keys})

    @cached_property
    def normal(self) -> dict[str, Scalar]:
        """Results of the normal law; a part without a potential is left out of an ``elastic`` contact."""
        item, zero = self._item, self._quantities.algebra.zero
        law = normal_laws.LAWS.get(item.normal.name, OF_FILE)
        results = self._record(law, item.normal, {**self.motion.local, **self._states})
        results = {"elastic": zero, "energy": zero, **results}
        return {**results, "force": results["elastic"]} if item.elastic else results

    @cached_property
    def tangential(self) -> dict[str, Scalar]:
        """Results of the tangential law, and rates of its states."""
        applied, quantities = self._item.tangential, self._quantities
        absent = dict.fromkeys((*_RESULTS, *STATES), quantities.algebra.zero)
        if applied is None:
            return absent
        known = {**self.motion.local, **self._states, "load": self.normal["force"]}
        return absent | self._states | self._record(friction_laws.LAWS[applied.name], applied, known)

    @cached_property
    def _states(self) -> dict[str, Scalar]:
        applied, numbers = self._item.tangential, self._quantities.state_numbers
        states = () if applied is None else friction_laws.LAWS[applied.name].states
        return {state: self._quantities.input("z", numbers[state_name(self._item.name, state)]) for state in states}


def contact_forces(quantities: Quantities, item: Contact) -> ContactForces:
    """Return motion and forces of a contact, recorded once."""
    known: dict[object, ContactForces] = quantities.recorded
    key = item.section, item.name, item.elastic
    if key not in known:
        known[key] = ContactForces(quantities, item)
    return known[key]


def add_contact(loads: Loads, item: Contact, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the wrenches of a contact on both bodies, the potential energy, J, and the power, W.
    A contact between base and world adds none."""
    if all(quantities.mount(frame).link < 0 for frame in (item.first, item.second)):
        return
    forces = contact_forces(quantities, item)
    motion, normal, friction = forces.motion, forces.normal, forces.tangential
    axes = dict(zip("xyz", (*motion.tangents, motion.normal), strict=True))
    force, moment = scaled(normal["force"], motion.normal), quantities.algebra.zero_vector
    for axis in "xy":
        force = plus(force, scaled(friction[f"force_{axis}"], axes[axis]))
    for axis, direction in axes.items():
        moment = plus(moment, scaled(friction.get(f"road_moment_{axis}", friction[f"moment_{axis}"]), direction))
    elastic = scaled(normal["elastic"], motion.normal)
    loads.potential = loads.potential + normal["energy"]
    loads.power = loads.power + dot(minus(force, elastic), motion.slip) + dot(moment, motion.turning)
    sides = ((item.second, motion.pair.second, item.first), (item.first, motion.pair.first, item.second))
    for frame, pose, opposite in sides:
        link, origin = quantities.kinematics.local(frame.body, quantities.vector(frame.position))
        if link < 0:  # base and world take no load
            continue
        to_link, sign = transpose(motion.pair.kinematics.pose(link)[0]), 1.0 if frame is item.second else -1.0
        arm = plus(origin, apply(to_link, minus(motion.point, pose.origin)))
        pushed, turned = (apply(to_link, scaled(sign, part)) for part in (force, moment))
        wrench = (plus(turned, cross(arm, pushed)), pushed)
        add_wrench(loads.wrenches, link, wrench)
        if opposite.body == WORLD:
            add_wrench(loads.external, link, wrench)


def _offer(group: str, name: str) -> Offer:
    return lambda quantities, item: getattr(contact_forces(quantities, item), group)[name]


LAW = Law(
    Contact,
    add_contact,
    {
        **{kind: _offer("local", name) for name, kind in LOCAL_NAMES.items()},
        "normal_force": _offer("normal", "force"),
        **{f"contact_{axis}": _offer("place", axis) for axis in "xyz"},
        **{f"friction_force_{axis}": _offer("tangential", f"force_{axis}") for axis in "xy"},
        **{name: _offer("tangential", name) for name in (*OF_LAWS, *STATES)},
    },
)
