"""Section loads of runs: outputs of a station, what clamps transmit, places between nodes, files, figures, tables."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

import eomgen
from eomgen.cli import main
from eomgen.errors import DescriptionError, UsageError
from eomgen.scene.load import from_data
from tests.models.cosserat import beam_scene

OUTPUTS: dict[str, dict[str, Any]] = {
    "force": {"section_force": "rope", "at": 0.0},
    "moment": {"section_moment": "rope", "at": 0.0},
    "transmitted_force": {"reaction_force": "clamp"},
    "transmitted_moment": {"reaction_moment": "clamp"},
    "between": {"section_moment": "rope", "at": 4.0},
    "end": {"section_force": "rope", "at": 10.0},
    "bent": {"section_curvature": "rope", "at": 4.0},
    "stretched": {"section_strain": "rope", "at": 4.0},
}


def scene_of(**outputs: dict[str, Any]) -> dict[str, Any]:
    beam = {"stiffness_damping": 0.01, "curvature": [0.01, 0.02, -0.03]}
    scene = beam_scene(4, {"force": ["20 * t", "-30 * t", 10.0]}, beam)
    return {**scene, "outputs": outputs or OUTPUTS, "parameters": {"load": {"value": 1.0, "tunable": True}}}


@cache
def run() -> eomgen.Solution:
    return eomgen.build(scene_of(), profile="quick").simulate(0.5, 2e-3, error_estimate=False)


@pytest.mark.long
def test_outputs_are_the_loads_along_the_axis() -> None:
    solution = run()
    loads = solution.section_loads["rope"]
    np.testing.assert_allclose(loads.nodes, [0.0, 2.5, 5.0, 7.5, 10.0], rtol=1e-15)
    for name, x, part in (("force", 0.0, 1), ("moment", 0.0, 0), ("between", 4.0, 0), ("end", 10.0, 1)):
        np.testing.assert_allclose(solution.outputs[name], loads.at(x)[part], rtol=1e-12, atol=1e-12)
    share = 0.6
    expected = (1.0 - share) * loads.moment_at_ends[:, 1, 0] + share * loads.moment_at_ends[:, 1, 1]
    np.testing.assert_allclose(loads.at(4.0)[0], expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(solution.outputs["bent"], loads.curvature[:, 1])
    np.testing.assert_array_equal(solution.outputs["stretched"], loads.strain[:, 1])
    units = solution.metadata["units"]["outputs"]
    assert [units[name] for name in ("force", "moment", "bent", "stretched")] == ["N", "N m", "1/m", "1"]


@pytest.mark.slow
def test_a_model_tells_loads_of_any_state_and_a_file_keeps_them(tmp_path: Path) -> None:
    solution = run()
    loads = solution.section_loads["rope"]
    model = solution.model.model  # type: ignore[union-attr]  # a solution of simulate has its model
    one = model.section_loads(solution.q[7], solution.v[7])["rope"]
    np.testing.assert_array_equal(one.moment, loads.moment[7])
    assert one.force_at_ends.shape == (4, 2, 3)
    still = model.section_loads(solution.q[7])["rope"]
    np.testing.assert_array_equal(still.strain, loads.strain[7])
    assert np.abs(still.moment - one.moment).max() > 1e-3 * np.abs(one.moment).max()
    kept = eomgen.Solution.load(solution.save(tmp_path / "run.npz")).section_loads["rope"]
    for name, array in loads.named().items():
        np.testing.assert_array_equal(getattr(kept, name), array)
    parts = [model.simulate(0.2, 2e-3, checkpoint=tmp_path / "c", error_estimate=False)]
    parts.append(model.resume(tmp_path / "c", 0.5))
    for part in parts:
        assert part.section_loads
    stored, rest = (eomgen.Solution.load(part.save(tmp_path / "part.npz")) for part in parts)
    for first in (stored, parts[0]):
        np.testing.assert_array_equal(first.followed_by(rest).section_loads["rope"].moment, loads.moment)


@pytest.mark.long
def test_the_shear_of_a_beam_without_shear_is_a_multiplier() -> None:
    kinds = ("force", "moment", "transmitted_force", "transmitted_moment")
    scene = scene_of(**{name: OUTPUTS[name] for name in kinds})
    scene["beams"]["rope"] |= {"model": "kirchhoff", "elements": 2}
    scene["beams"]["rope"]["stiffness"] = {
        name: value for name, value in scene["beams"]["rope"]["stiffness"].items() if not name.startswith("shear")
    }
    model = eomgen.build(scene, profile="quick")
    solution = model.simulate(0.2, 4e-3, error_estimate=False)
    loads = solution.section_loads["rope"]
    assert np.abs(loads.force[-1, :, 1:]).min() > 0.1
    np.testing.assert_array_equal(loads.force[..., 1:], solution.multipliers.reshape(-1, 2, 2))
    np.testing.assert_array_equal(loads.at(0.0)[1], solution.outputs["force"])
    for name in ("force", "moment"):
        transmitted = -solution.outputs[f"transmitted_{name}"]
        np.testing.assert_allclose(solution.outputs[name], transmitted, atol=1e-9 * np.abs(transmitted).max())


@pytest.mark.long
def test_the_command_line_draws_sections_and_tells_the_largest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = Path(__file__).with_name("cantilever.toml")
    options = ["--t-end", "0.2", "--step", "0.01", "--profile", "quick", "--out", str(tmp_path / "run")]
    assert main(["simulate", str(scene), *options, "--json"]) == 0
    largest = json.loads(capsys.readouterr().out)["section_loads"]["arm"]["force"]
    loads = eomgen.build(scene, profile="quick").simulate(0.2, 0.01, error_estimate=False).section_loads["arm"]
    sizes = np.linalg.norm(loads.force_at_ends, axis=-1)
    assert largest["size"] == pytest.approx(sizes.max(), rel=1e-9)
    assert largest["x"] in loads.nodes.tolist() and 0.0 <= largest["t"] <= 0.2
    assert imread(tmp_path / "run" / "sections_arm.png").shape[0] > 500
    assert main(["simulate", str(scene), *options, "--no-plots"]) == 0
    assert re.search(r"largest section moment of arm +.* N m at x = 0 m, t = 0\.\d+ s", capsys.readouterr().out)


REFUSED = {
    "place": ({"section_force": "rope"}, "(outputs.cut): section_force needs the place of the section; try: at = 5"),
    "beyond": (
        {"section_force": "rope", "at": 10.5},
        "(outputs.cut.at): x = 10.5 m is not on the beam rope, which goes from 0 m to 10 m",
    ),
    "unknown": (
        {"section_moment": "robe", "at": 1.0},
        "(outputs.cut.section_moment): there is no beam 'robe'; try: rope",
    ),
    "of no section": (
        {"energy": "kinetic", "at": 1.0},
        "(outputs.cut.at): at is a place on a beam, of outputs of its sections; try: section_moment",
    ),
}


@pytest.mark.parametrize(("output", "message"), list(REFUSED.values()), ids=list(REFUSED))
def test_what_no_section_can_be_is_refused_with_one_message(output: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(scene_of(cut=output))
    assert len(caught.value.problems) == 1, str(caught.value)


def test_a_beam_of_another_model_has_no_sections() -> None:
    scene = scene_of(cut={"section_force": "rope", "at": 1.0})
    slim = {"length": 10.0, "mass_per_length": 1.0, "bending_z": {"modes": 1, "stiffness": 500.0}}
    scene["beams"] = {"rope": slim}
    message = '(outputs.cut.section_force): the beam rope is not geometrically exact; try: model = "cosserat"'
    with pytest.raises(DescriptionError, match=re.escape(message)):
        from_data(scene)
    del scene["outputs"]
    model = eomgen.build(scene, profile="quick")
    with pytest.raises(UsageError, match="the model has no geometrically exact beam; try: model ="):
        model.section_loads(model.initial_q)
