"""Tutorials and how-to pages run as they stand, print what they show, and make their pictures."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib
import pytest

from eomgen.cli import main
from tests.docs.executed import PAGES, executed, pictures


@pytest.mark.long_except_every(20)
@pytest.mark.slow
@pytest.mark.long_cases(
    "page_for_a_colleague",
    "c_code_for_a_microcontroller",
    "check_derivatives",
    "compare_two_runs",
    "ensemble_on_a_cluster",
    "fmu_for_simulink",
    "force_element_plug_in",
    "many_runs",
    "natural_frequencies_and_modes",
    "ride_comfort_on_a_rough_road",
    "short_recipes",
    "active_vehicle",
    "four_bar",
    "pendulum",
)
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_runs_as_it_stands(page: Path, tmp_path: Path) -> None:
    matplotlib.use("Agg")
    text = page.read_text(encoding="utf-8")
    assert executed(text, tmp_path, page.stem) == text, f"run: python -m tests.docs.executed {page}"
    for picture in pictures(text):
        assert (tmp_path / picture).is_file()


PAGE = """\
```toml
# some.toml
a = 1
```

```toml
# some.toml, appended
b = 2
```

```python
print(open("some.toml").read().split("\\n", 1)[1], end="")
```

```text
a = ...
{second}
```

```console
$ echo one two
one ...
```
"""


def test_output_that_agrees_stays_and_other_output_is_replaced(tmp_path: Path) -> None:
    right = PAGE.format(second="b = 2")
    assert executed(right, tmp_path) == right
    assert "```text\na = 1\nb = 2\n```" in executed(PAGE.format(second="b = 3"), tmp_path)


def test_errors_of_blocks_are_raised(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        executed("```python\n1 / 0\n```\n", tmp_path)
    with pytest.raises(Exception, match="returned non-zero exit status"):
        executed("```console\n$ false\n```\n", tmp_path)


@pytest.mark.long
def test_the_overview_goes_on_with_the_scene_of_the_first_page(
    tmp_path: Path, shared_cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(__file__).parents[2]
    pages = [(root / name).read_text(encoding="utf-8") for name in ("README.md", "docs/overview.md")]
    first, *_ = re.findall(r"^```toml\n(.*?)^```", pages[0], re.DOTALL | re.MULTILINE)
    more, *_ = re.findall(r"^```toml\n(.*?)^```", pages[1], re.DOTALL | re.MULTILINE)
    commands = re.findall(r"^    \.venv/bin/eomgen (.*?)(?:\s+#.*)?$", "\n".join(pages), re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    Path("pendulum.toml").write_text(first, encoding="utf-8")
    for number, command in enumerate(commands):
        if command.split()[0] not in ("simulate", "generate"):
            continue  # studies of minutes
        if number == 2:
            Path("pendulum.toml").write_text(first + more, encoding="utf-8")
        assert main(command.split()) == 0, capsys.readouterr().err
    studies = [command.split() for command in commands if command.split()[0] not in ("simulate", "generate")]
    assert len(commands) == len(studies) + 3 and all(command[1] == "pendulum.toml" for command in studies)
