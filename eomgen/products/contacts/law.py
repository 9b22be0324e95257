"""Forces of contacts on both bodies at the contact point, equal and opposite, with the potential of elastic parts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from operator import attrgetter

from eomgen.mechanics.forces.frame_pairs import frame_pair
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Offer, Quantities
from eomgen.products.contacts import friction_laws, normal_laws
from eomgen.products.contacts.laws import LOCAL_NAMES, NORMAL_NAMES, AppliedLaw, ContactLaw, state_name
from eomgen.products.contacts.pair import PairMotion
from eomgen.products.contacts.section import OF_LAWS, STATES, Contact
from eomgen.products.contacts.slip_laws import OF_FILE
from eomgen.products.contacts.tyres import Tyre
from eomgen.symbolic.scalar import Scalar, apply, cross, dot, minus, plus, scaled, transpose
from eomgen.system.description import WORLD

#: Results of tangential laws, each 0 in a law without it.
_RESULTS = ("force_x", "force_y", "moment_x", "moment_y", "moment_z")


class ContactForces:
    """Forces of a contact in a motion on the tape, each recorded at the first use."""

    def __init__(self, quantities: Quantities, item: Contact, motion: PairMotion) -> None:
        self._quantities, self._item, self.motion = quantities, item, motion

    def _record(
        self, law: ContactLaw, applied: AppliedLaw, names: str, more: Mapping[str, Scalar]
    ) -> dict[str, Scalar]:
        keys = {name: self._quantities.formula(value) for name, value in applied.values.items()}
        return law.record(self._quantities.algebra, {**getattr(self.motion, names), **more, **keys})

    @cached_property
    def normal(self) -> dict[str, Scalar]:
        """Results of the normal law; a part without a potential is left out of an ``elastic`` contact."""
        item, zero = self._item, self._quantities.algebra.zero
        if item.normal.name == OF_FILE.name:
            results = self._record(OF_FILE, item.normal, "local", self._states)
        else:
            results = self._record(normal_laws.LAWS[item.normal.name], item.normal, "along_normal", {})
        lossless = {} if item.moving_surface else results  # a moving surface does work: its force has no potential
        results |= {name: lossless.get(name, zero) for name in ("elastic", "energy")}
        results |= {"force": results["elastic"]} if item.elastic else {}
        return {**results, "load": results["force"] * self.motion.steepness}

    @cached_property
    def tangential(self) -> dict[str, Scalar]:
        """Results of the tangential law, and rates of its states."""
        applied, quantities = self._item.tangential, self._quantities
        absent = dict.fromkeys(_RESULTS, quantities.algebra.zero)
        if applied is None:
            return absent
        more = {"load": self.normal["load"], **self._states}
        return absent | self._states | self._record(friction_laws.LAWS[applied.name], applied, "local", more)

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
        motion = PairMotion(quantities, item, frame_pair(quantities, item.first, item.second))
        known[key] = ContactForces(quantities, item, motion)
    return known[key]


def add_contact(loads: Loads, item: Contact, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the wrenches of a contact on both bodies, the potential energy, J, and the power, W.
    A contact between base and world adds none."""
    if all(quantities.mount(frame).link < 0 for frame in (item.first, item.second)):
        return
    forces = contact_forces(quantities, item)
    motion, normal = forces.motion, forces.normal
    pressed, zero = scaled(normal["force"], motion.gradient), quantities.algebra.zero
    friction = moment = quantities.algebra.zero_vector
    if item.tangential is not None:
        results = forces.tangential
        for axis, direction in zip("xyz", (*motion.tangents, motion.normal), strict=True):
            about = results.get(f"road_moment_{axis}", results[f"moment_{axis}"])
            friction = plus(friction, scaled(results.get(f"force_{axis}", zero), direction))
            moment = plus(moment, scaled(about, direction))
    loads.potential = loads.potential + normal["energy"]
    lossy = minus(pressed, scaled(normal["elastic"], motion.gradient))
    loads.power = loads.power + dot(lossy, motion.approach) + dot(friction, motion.slip) + dot(moment, motion.turning)
    force = plus(pressed, friction)
    sides = ((item.second, motion.pair.second, item.first), (item.first, motion.pair.first, item.second))
    for frame, pose, opposite in sides:
        link, origin = quantities.kinematics.local(frame.body, quantities.vector(frame.position))
        if link < 0:  # base and world take no load
            continue
        to_link, sign = transpose(motion.pair.kinematics.pose(link)[0]), 1.0 if frame is item.second else -1.0
        through_centre = motion.round and item.tangential is None and frame is item.second
        arm = apply(to_link, minus(pose.origin if through_centre else motion.point, pose.origin))
        pushed, turned = (apply(to_link, scaled(sign, part)) for part in (force, moment))
        wrench = (plus(turned, cross(plus(origin, arm), pushed)), pushed)
        add_wrench(loads.wrenches, link, wrench)
        if opposite.body == WORLD:
            add_wrench(loads.external, link, wrench)


def _offer(group: str, name: str) -> Offer:
    return lambda quantities, item: attrgetter(group)(contact_forces(quantities, item))[name]


LAW = Law(
    Contact,
    add_contact,
    {
        **{kind: _offer("motion.local", name) for name, kind in LOCAL_NAMES.items()},
        **{LOCAL_NAMES[name]: _offer("motion.along_normal", name) for name in NORMAL_NAMES},
        "normal_force": _offer("normal", "load"),
        **{f"contact_{axis}": _offer("motion.place", axis) for axis in "xyz"},
        **{f"friction_force_{axis}": _offer("tangential", f"force_{axis}") for axis in "xy"},
        **{name: _offer("tangential", name) for name in (*OF_LAWS, *STATES)},
    },
)
TYRES = Law(
    Tyre, add_contact, {"load": _offer("normal", "load"), "deflection": _offer("motion.along_normal", "overlap")}
)
