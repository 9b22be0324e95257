"""Each row of the register of force elements in all its uses; what its values must be is in
``tests/scene/test_requirements.py``.

Nothing here names a kind: ``every_value`` holds an entry of each, so a new row is tested as it stands.
"""

from __future__ import annotations

from typing import Any

import pytest

from docs.scene_tables import tables
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.mechanics.forces.applied import offered_by
from eomgen.products.pictures.scenery import scenery
from eomgen.products.testing.contracts import check_law_of_element
from eomgen.products.testing.demands import power_error
from eomgen.scene.document.reference import schema
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.scene.sections import own_sections
from tests.scene.every_value import LEVEL, SCENE, TILTED

pytestmark = pytest.mark.slow

#: Of the core and of products, in the order of the sections.
ELEMENTS = [row for row in own_sections() if isinstance(row, ElementSection)]
EVERY = pytest.mark.parametrize("row", ELEMENTS, ids=lambda row: row.key)
ENTRIES: dict[str, Any] = {"efforts": {"motor": {"joint": "hinge", "effort": "2 - 0.3 * v.hinge"}}, **SCENE}
#: Parts of the scene of every value: an arm on a hinge, a nut on a screw, a free disc, a puck on a table;
#: with them a beam on the base.
BODIES = {"arm": "hinge", "nut": "screw", "disc": "free", "puck": "table"}


def scene_with(row: ElementSection, formula: str = "t") -> Scene:
    bodies = {name: SCENE["bodies"][name] for name in BODIES}
    joints = {name: SCENE["joints"][name] for name in (*BODIES.values(), "root")}
    bare = {key: SCENE[key] for key in ("format", "name", "gravity", "points")}
    if row.key not in LEVEL:
        bare["gravity"] = list(TILTED)
    outputs = {"seen": {"formula": formula}}
    return from_data(
        {
            **bare,
            "bodies": bodies,
            "beams": {"blade": SCENE["beams"]["blade"]},
            "joints": joints,
            "outputs": outputs,
            row.key: dict([next(iter(ENTRIES[row.key].items()))]),
        }
    )


@EVERY
def test_every_row_has_a_law_that_gives_what_it_offers(row: ElementSection) -> None:
    assert row.key == row.model.section
    [element] = scene_with(row).elements
    check_law_of_element(element)


@EVERY
def test_files_builders_schema_and_pages_know_it(row: ElementSection) -> None:
    [element] = scene_with(row).elements
    assert isinstance(element, row.model) and getattr(scene_with(row), row.key, (element,)) == (element,)
    assert schema()["properties"][row.key]["additionalProperties"] == {"$ref": f"#/$defs/{row.schema.__name__}"}
    assert tables()[row.schema.__name__.removesuffix("Entry")] is row.schema


@EVERY
def test_its_power_is_that_of_its_wrenches_and_its_potential(row: ElementSection) -> None:
    assert power_error(scene_with(row)) <= 1e-11


@EVERY
def test_formulas_read_what_it_offers(row: ElementSection) -> None:
    """But for quantities of laws that the entry does not have, which are refused with the laws that have them."""
    [element] = scene_with(row).elements
    read = 0
    for kind in row.offers:
        try:
            scene = scene_with(row, f"{kind}.{element.name}")
        except DescriptionError as error:
            assert f"{element.name}' with {kind}" in str(error) and "; try: " in str(error)
            continue
        read += 1
        assert offered_by(scene)[kind][0] == row.key and "outputs" in derive(scene, ["outputs"]).functions
    assert read or not row.offers


@EVERY
def test_pictures_show_what_it_says(row: ElementSection) -> None:
    scene = scene_with(row)
    [element] = scene.elements
    shown = scenery(describe(scene), {})
    named = {item["name"] for items in (shown["springs"], shown["tyres"]) for item in items}
    assert named == ({element.name} if element.drawn() is not None else set())
