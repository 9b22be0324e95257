"""Models of beams without shear or stretch in scene files: what they need, and what they do not take."""

# ruff: noqa: E501 (a row of the table is a message, quoted whole)

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.load import from_data
from tests.models.cosserat import ROLL_UP, beam_scene

FREE = {
    "kirchhoff": {key: ROLL_UP[key] for key in ("stretch", "torsion", "bending_y", "bending_z")},
    "inextensible": {key: ROLL_UP[key] for key in ("torsion", "bending_y", "bending_z")},
}
SECTION = {
    "elastic_modulus": 200.0, "density": 3.0, "area": 0.5, "second_moments": [0.2, 0.7],
    "shear_modulus": 80.0, "torsion_constant": 0.4,
}  # fmt: skip  # a table


def scene_of(model: str, **beam: Any) -> dict[str, Any]:
    """Return a beam of 4 elements; keys with the value None are taken away."""
    data = beam_scene(4, {"force": [0.0, 0.0, 1.0]}, {"model": model, "stiffness": FREE[model], **beam})
    data["beams"]["rope"] = {key: value for key, value in data["beams"]["rope"].items() if value is not None}
    return data


def diagonal_of(data: dict[str, Any]) -> list[float]:
    beam = next(item.beam for item in from_data(data).elements if isinstance(item, CosseratBeam))
    matrix = np.array([[evaluate(entry, lambda _: 1.0) for entry in row] for row in beam.parts[0].section.stiffness])
    assert not np.any(matrix - np.diag(np.diag(matrix)))
    return [float(entry) for entry in np.diag(matrix)]


@pytest.mark.parametrize(
    ("model", "expected"),
    [("kirchhoff", [32.0, 140.0, 40.0, 100.0, 0.0, 0.0]), ("inextensible", [32.0, 140.0, 40.0, 0.0, 0.0, 0.0])],
)
def test_a_section_has_no_stiffness_against_strains_that_are_not_there(model: str, expected: list[float]) -> None:
    data = scene_of(model, section=SECTION, stiffness=None, mass_per_length=None, rotary_inertia=None)
    assert diagonal_of(data) == pytest.approx(expected)
    assert diagonal_of(scene_of(model, stiffness=None, stiffness_matrix=np.diag(expected).tolist())) == expected


def test_tables_give_the_stiffness_of_the_strains_that_are_there() -> None:
    assert diagonal_of(scene_of("kirchhoff")) == [500.0, 500.0, 500.0, 1e4, 0.0, 0.0]
    assert diagonal_of(scene_of("inextensible")) == [500.0, 500.0, 500.0, 0.0, 0.0, 0.0]


REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("inextensible", {"damping": {"stretch": 1.0}}, "(beams.rope.damping.stretch): a beam of the model inextensible"),
    (
        "kirchhoff",
        {"stiffness": None, "stiffness_matrix": np.diag([5.0, 5.0, 5.0, 1e4, 1e4, 0.0]).tolist()},
        "(beams.rope.stiffness_matrix): the model kirchhoff has no shear_y, and row [4] of the matrix is not 0; try: 0 in rows and columns of strains that it does not have",
    ),
    ("inextensible", {"elements": None}, "(beams.rope): a beam of the model inextensible needs the number"),
    ("inextensible", {"stiffness": None}, "(beams.rope): the sections have no stiffness; try: stiffness = { bending_y"),
]  # fmt: skip  # a table


@pytest.mark.parametrize(("model", "beam", "message"), REFUSED)
def test_what_such_a_beam_cannot_have_is_refused_with_one_message(
    model: str, beam: dict[str, Any], message: str
) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(scene_of(model, **beam))
    assert len(caught.value.problems) == 1, str(caught.value)


def test_shear_stiffness_is_needed_where_a_beam_shears() -> None:
    data = beam_scene(4, {"force": [0.0, 0.0, 1.0]}, {"stiffness": FREE["kirchhoff"]})
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    assert [problem.what for problem in caught.value.problems] == [
        "the key shear_y is missing",
        "the key shear_z is missing",
    ]
