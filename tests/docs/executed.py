"""Pages whose blocks are executed in order, as a reader would: tutorials and how-to pages.

Blocks of ``toml``, ``yaml`` and ``c`` whose first line names a file are written to it, or appended. Blocks of
``python`` share their names; the block of ``text`` below one is what it prints. Lines of ``console`` after ``$ `` are
commands, and the other lines are what the commands print. ``...`` stands for any text. A picture of a page has the name
of a file that a block writes.

``python -m tests.docs.executed docs/tutorials/pendulum.md`` writes the present output, where the page has another one;
with ``--pictures FOLDER`` it writes the pictures of the page, in place of the output.
"""

from __future__ import annotations

import argparse
import contextlib
import doctest
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGES = sorted([*(ROOT / "docs" / "tutorials").glob("*.md"), *(ROOT / "docs" / "how_to").glob("*.md")])
_BLOCK = re.compile(r"^```(toml|c|csv|xml|yaml|python|text|console)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"(?:# |/\* |<!-- )([\w/]+\.(?:toml|c|csv|py|urdf|sdf|xml|yaml))(, appended)?(?: \*/| -->)?\n")
_PICTURE = re.compile(r"!\[[^\]]*\]\(([\w.]+)\)")
#: Seconds that one command may take.
_LIMIT = 300


def pictures(text: str) -> list[str]:
    """Return the names of the pictures that the blocks of a page make."""
    return _PICTURE.findall(text)


def executed(text: str, folder: Path, name: str = "page") -> str:
    """Return the text of a page with what its blocks print, after all blocks have run in a folder.

    Output that the page has, up to ``...``, stays as it is. An error of a block is raised; a command that fails raises
    ``subprocess.CalledProcessError``.
    """
    names: dict[str, Any] = {"__name__": name}
    printed: str | None = None

    def renewed(match: re.Match[str]) -> str:
        nonlocal printed
        language, block = match[1], match[2]
        if language == "text":
            made, printed = printed, None
            return match[0] if made is None else f"```text\n{_kept(block, made)}```"
        if language == "console":
            return f"```console\n{_session(block, folder)}```"
        file = _FILE.match(block)
        if file:
            path = folder / file[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            before = path.read_text(encoding="utf-8") if file[2] else ""
            path.write_text(before + (block[file.end() :] if file[2] else block), encoding="utf-8")
        elif language == "python":
            line = text.count("\n", 0, match.start(2))
            code = compile("\n" * line + block, f"{name}.md", "exec")
            with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.chdir(folder):
                exec(code, names)
            printed = out.getvalue()
        return match[0]

    return _BLOCK.sub(renewed, text)


def _kept(block: str, made: str) -> str:
    """Return a block of output if what was printed agrees with it, else what was printed."""
    made = re.sub(r"[ \t]+$", "", made, flags=re.MULTILINE)
    same = doctest.OutputChecker().check_output(block, made, doctest.ELLIPSIS)
    return block if same and block.strip() != "..." else made


def _session(block: str, folder: Path) -> str:
    parts = re.split(r"^\$ (.*)\n", block, flags=re.MULTILINE)
    text = ""
    for command, output in zip(parts[1::2], parts[2::2], strict=True):
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        run = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env={**os.environ, "PATH": path, "COLUMNS": "100"},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            check=True,
            timeout=_LIMIT,
        )
        text += f"$ {command}\n{_kept(output, run.stdout)}"
    return text


def main(arguments: list[str]) -> int:
    """Renew the outputs of pages, or write their pictures."""
    import matplotlib

    matplotlib.use("Agg")
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder of the pictures")
    options = parser.parse_args(arguments)
    for path in options.pages:
        text = path.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as name:
            if options.pictures is None:
                path.write_text(executed(text, Path(name), path.stem), encoding="utf-8")
                continue
            executed(text[: max(found.start() for found in _PICTURE.finditer(text))], Path(name), path.stem)
            for picture in pictures(text):
                shutil.copy(Path(name) / picture, options.pictures / picture)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
