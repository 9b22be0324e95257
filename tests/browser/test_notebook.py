"""A notebook as a browser shows it: cells run by a kernel, converted by nbconvert, opened in Chromium."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import eomgen

pytestmark = pytest.mark.slow

if TYPE_CHECKING:
    import nbformat

EXAMPLES = Path(eomgen.__file__).parent.parent / "examples"
CELLS = (
    "import eomgen\nscene = eomgen.load({path!r})\nscene",
    "eomgen.derive(scene, ['mass', 'coupling', 'force'])",
    "model = eomgen.build(scene, profile='quick')\nsolution = model.simulate(2.0, progress=True)\nsolution",
    "%matplotlib inline\nsolution.plot('coordinates', 'energy');",
    "linear = model.linearize(at='initial')\nlinear",
    "linear.modes().plot();",
)


@pytest.fixture(scope="module")
def notebook() -> nbformat.NotebookNode:
    import nbformat  # with what runs and converts it only where all tests run, `make test-all`
    from nbclient import NotebookClient

    path = str(EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml")
    cells = [nbformat.v4.new_code_cell(text.replace("{path!r}", repr(path))) for text in CELLS]
    written = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(written, timeout=120, kernel_name="python3").execute()
    return written


def outputs_of(notebook: nbformat.NotebookNode, cell: int, kind: str) -> list[str]:
    return [output["data"][kind] for output in notebook.cells[cell].outputs if kind in output.get("data", {})]


@pytest.mark.long
def test_every_cell_shows_what_it_should(notebook: nbformat.NotebookNode) -> None:
    scene, system, solution, linear = (outputs_of(notebook, cell, "text/html")[-1] for cell in (0, 1, 2, 4))
    assert "shoulder" in scene and "$$\\displaystyle M = " in system
    assert "estimated error" in solution and "modes" in linear
    assert len(outputs_of(notebook, 3, "image/png")) == len(outputs_of(notebook, 5, "image/png")) == 1
    assert outputs_of(notebook, 1, "text/latex")
    assert outputs_of(notebook, 2, "text/html")[0] == "", "the bar of progress is gone when the run is over"
