"""A notebook as a browser shows it: cells run by a kernel, converted by nbconvert, opened in Chromium."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import eomgen
from tests.browser.chromium import Browser

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


@pytest.mark.long
def test_the_page_is_laid_out(notebook: nbformat.NotebookNode, browser: Browser, tmp_path: Path) -> None:
    from nbconvert import HTMLExporter

    page, _ = HTMLExporter(template_name="lab", mathjax_url="", require_js_url="").from_notebook_node(notebook)
    file = tmp_path / "notebook.html"
    file.write_text(page, encoding="utf-8")
    document = Browser(browser.command, 1100, 6000)
    picture = document.picture(file)
    inked = np.flatnonzero(np.any(picture < 200, axis=(1, 2)))
    assert len(inked) > 1000, f"{sys.executable}: the page has hardly any rows with ink"
    coloured = np.ptp(picture, axis=2) > 60
    assert np.count_nonzero(coloured) > 2000, "there are no curves on the page"
