"""``-v`` and the logger ``eomgen``: what is derived, compiled and run, beside an output that stays as it is."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from tests.models.scenes import pendulum


def test_verbose_says_what_is_done_on_stderr(tmp_path: Path, capsys) -> None:
    scene = tmp_path / "slider.toml"
    scene.write_text(
        'format = 1\nname = "slider"\n[bodies]\nslug = { mass = 1.0 }\n[joints]\n'
        'slide = { type = "prismatic", parent = "base", child = "slug", axis = [1, 0, 0] }\n',
        encoding="utf-8",
    )
    assert main(["info", str(scene), "--json"]) == 0
    quiet = capsys.readouterr()
    assert main(["info", str(scene), "--json", "-v"]) == 0
    told = capsys.readouterr()
    assert told.out == quiet.out and quiet.err == ""
    assert "eomgen.pipeline.programs: derived slider in " in told.err
    assert main(["info", str(tmp_path / "none.toml"), "-v"]) == 7
    logger = logging.getLogger("eomgen")
    assert not logger.handlers and not logger.level


def test_a_run_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "eomgen"):
        run = pendulum().simulate(0.01, 1e-3)
    assert f"ran shaken with {run.metadata['method']} in " in caplog.text and run.message in caplog.text


def test_the_cache_is_named(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "eomgen"):
        eomgen.build(pendulum().scene, profile="quick")
    assert "took the library from the cache, /" in caplog.text
