"""What the emitted README says of checkpoints: state and workspace, written and read back, go on with the same bits."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from tests.codegen.test_stand_alone import cart, compiled, run

DRIVER = """
#include <stdio.h>
#include <string.h>
#include "NAME.h"

static NAME_workspace work;
static NAME_state state;

static int advance(const NAME_parameters *p, const NAME_settings *s, int steps)
{
    NAME_status status = NAME_OK;
    while (steps-- > 0 && status == NAME_OK)
        status = NAME_step(p, s, &state, &work, NULL);
    return (int)status;
}

/* run FILE: 80 steps, a checkpoint after 30; resume FILE: the last 50 of them.
   Both print the bytes of the state at the end. */
int main(int argc, char **argv)
{
    NAME_parameters p;
    NAME_settings s;
    FILE *file = argc == 3 ? fopen(argv[2], strcmp(argv[1], "run") == 0 ? "wb" : "rb") : NULL;
    size_t done, k;
    if (file == NULL)
        return 1;
    NAME_default_parameters(&p);
    NAME_default_settings(&s);
    if (strcmp(argv[1], "run") == 0) {
        NAME_default_state(&state);
        if (NAME_initialize(&p, &s, &state, &work, NULL) != NAME_OK || advance(&p, &s, 30) != 0)
            return 2;
        done = fwrite(&state, sizeof state, 1, file) + fwrite(&work, sizeof work, 1, file);
    } else {
        done = fread(&state, sizeof state, 1, file) + fread(&work, sizeof work, 1, file);
    }
    fclose(file);
    if (done != 2 || advance(&p, &s, 50) != 0)
        return 3;
    for (k = 0; k < sizeof state; ++k)
        printf("%02x", ((const unsigned char *)&state)[k]);
    printf(" %ld\\n", state.count);
    return 0;
}
"""


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
