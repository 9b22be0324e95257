"""Every section of a scene file has a diagram that is drawn from its script, is on its page, and can be read."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from docs.diagrams.__main__ import DIAGRAMS, main
from docs.diagrams.canvas import Canvas, length_of, overlaps
from eomgen.scene.document.schema import every_document

DOCUMENT = every_document()

PAGES = Path(__file__).parents[2] / "docs" / "scene"


def test_every_section_has_a_diagram() -> None:
    assert {row.key for row in DOCUMENT.rows} - DIAGRAMS.keys() == {"doubts"}  # which describes no part of a machine
    assert sorted(path.stem for path in (PAGES / "diagrams").glob("*.svg")) == sorted(DIAGRAMS)


def test_diagrams_are_drawn_by_their_script(tmp_path: Path) -> None:
    assert main([str(tmp_path)]) == 0
    for path in sorted(tmp_path.iterdir()):
        drawn, kept = path.read_text(encoding="utf-8"), (PAGES / "diagrams" / path.name).read_text(encoding="utf-8")
        assert drawn == kept, f"{path.name}: run: python -m docs.diagrams docs/scene/diagrams"


@pytest.mark.parametrize("name", DIAGRAMS)
def test_a_diagram_is_on_its_page_and_its_labels_can_be_read(name: str) -> None:
    diagram = DIAGRAMS[name]
    assert (PAGES / f"{name}.md").read_text(encoding="utf-8").count(f"![{diagram.text}](diagrams/{name}.svg)") == 1
    assert overlaps(diagram.canvas().labels, diagram.height) == []
    root = ElementTree.fromstring(diagram.svg())
    sizes = [float(text.get("font-size", "13")) for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert sizes and min(sizes) >= 11.0  # of a picture of 400 units, shown in a window of 400 pixels
    assert len(re.findall(r"<(?:path|circle|rect)", diagram.svg())) > 4


def test_labels_that_meet_or_leave_the_picture_are_reported() -> None:
    canvas = Canvas(100.0)
    canvas.text(200.0, 50.0, "one_1")
    canvas.text(210.0, 52.0, "two")
    canvas.text(2.0, 90.0, "three")
    assert overlaps(canvas.labels, 100.0) == ["'three' leaves the picture", "'one_1' meets 'two'"]
    assert length_of("q_{elbow}") == pytest.approx(0.56 * 13.0 * (1 + 0.75 * 5))
