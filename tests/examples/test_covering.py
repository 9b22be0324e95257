"""The covering examples have all that any example has."""

from __future__ import annotations

import re

from tests.examples.covering import EXAMPLES, covering, features

SCENES = sorted(path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.glob("*/*.toml"))
#: Words of the text of a file that name a row of a register: types, shapes, methods, groups, coordinates.
WORD = re.compile(r'\b(?:type|shape|method|group|coordinates) = "\w+"')
#: A heading of a section or of an entry of it; entries of ``repeat`` are repeated ones of sections.
SECTION = re.compile(r"^\[(?!include|repeat)(\w+)", re.MULTILINE)


def test_every_type_and_section_of_the_examples_is_in_a_covering_one() -> None:
    taken = covering(SCENES)
    for pattern in (WORD, SECTION):
        words = {name: set(pattern.findall((EXAMPLES / name).read_text(encoding="utf-8"))) for name in SCENES}
        every = set().union(*words.values())
        assert len(every) > 15 and every == set().union(*(words[name] for name in taken))


def test_no_feature_is_lost_and_no_example_is_more_than_needed() -> None:
    taken = covering(SCENES)
    assert taken == covering(taken) and taken == sorted(taken) and len(taken) < 0.6 * len(SCENES)
    every = set().union(*map(features, SCENES))
    assert every == set().union(*map(features, taken)) and len(every) > 150
    for name in taken:
        assert every != set().union(*(features(other) for other in taken if other != name))


def test_features_are_those_of_included_and_repeated_entries_too() -> None:
    assert {"include", "joints.rotor_inertia", "bodies.mass", "joints.type=revolute"} <= features("sea_arm")
    net = {"repeat", "springs.damping", "bodies.group=R3xSO3", "joints.type=free", "coordinates.coordinates=absolute"}
    assert net <= features("cable_net/scene.toml") and "repeat.indices" not in features("cable_net")
