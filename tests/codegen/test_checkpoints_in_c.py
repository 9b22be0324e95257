"""What the emitted README says of checkpoints: state and workspace, written and read back, go on with the same bits."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from tests.codegen.test_stand_alone import cart, compiled, run

# include <stdio.h>
# include <string.h>
# include "NAME.h"
DRIVER = (Path(__file__).parent / "checkpoints.c").read_text(encoding="utf-8")


@pytest.mark.slow_except("rk4")
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4", "taylor"])
def test_a_program_goes_on_where_another_stopped(method: str, tmp_path: Path) -> None:
    scene = cart()
    eomgen.generate(scene, tmp_path / "c", method=method)
    assert "fwrite(&work, sizeof work, 1, file);" in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")
    names = DRIVER.replace("NAME_OK", f"{scene.name.upper()}_OK").replace("NAME", scene.name)
    (tmp_path / "c" / "main.c").write_text(names, encoding="utf-8")
    program = compiled(tmp_path / "c")
    ends = [run(program, word, str(tmp_path / "state")).stdout for word in ("run", "resume")]
    assert ends[0] == ends[1] and ends[0].endswith(" 80\n")
