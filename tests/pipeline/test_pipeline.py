"""What the road from a description to a model takes, and how it refuses the rest."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

import eomgen
from tests.models.scenes import PENDULUM_TOML, pendulum


def test_nested_data_go_the_road_of_a_scene_file() -> None:
    data = tomllib.loads(PENDULUM_TOML)
    model = eomgen.build(data, profile="quick")
    np.testing.assert_array_equal(model.force([0.3], [0.5], 0.2), pendulum().force([0.3], [0.5], 0.2))
    data["bodies"]["link"]["mas"] = 1.0
    with pytest.raises(
        eomgen.DescriptionError, match=r"scene \(bodies\.link\.mas\): the key 'mas' is unknown here; try: mass"
    ):
        eomgen.derive(data)


@pytest.mark.parametrize("given", [None, 3.0, ["scene.toml"]])
def test_what_is_no_scene_is_refused(given: object) -> None:
    kind = type(given).__name__
    with pytest.raises(
        eomgen.UsageError, match=f"a scene, a path or a mapping like a scene file is needed, not {kind}; try: "
    ):
        eomgen.build(given)  # type: ignore[arg-type]


def test_a_term_that_a_scene_cannot_have_is_not_advised() -> None:
    """Of a term that a build can add the advice is this build, else the scenes that have the term."""
    model = pendulum()
    for term, remedy in (("constraint", "a scene with constraints"), ("momenta", 'terms=[..., "momenta"]')):
        with pytest.raises(
            eomgen.UsageError, match=rf"the term {term} is not in this model, .*; try: .*{re.escape(remedy)}"
        ):
            model.evaluate(term, [0.3], [0.5])
