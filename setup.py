"""Packaging only: puts templates and examples of the top into the package: _templates, _examples.zip.xz."""

import lzma
import zlib
from pathlib import Path
from shutil import copytree, ignore_patterns
from zipfile import ZipFile, ZipInfo

from setuptools import setup
from setuptools.command.build_py import build_py

#: Endings of files of examples in the wheel: pictures would take ten times its room.
_OF_EXAMPLES = (".c", ".csv", ".md", ".py", ".tir", ".toml", ".urdf")


class BuildWithData(build_py):
    """The ordinary build, plus the templates that the installed package renders, and the examples that it copies."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            package = Path(self.build_lib) / "eomgen"
            ignored = ignore_patterns("__pycache__")
            copytree("templates", package / "_templates", dirs_exist_ok=True, ignore=ignored)
            _pack_examples(package / "_examples.zip.xz")


def _pack_examples(archive: Path) -> None:
    """Write the files of examples side by side, files of one kind behind one another, and compress them as one text, to
    half of the room of single files."""
    files = [path for path in Path("examples").glob("*/**/*") if path.suffix in _OF_EXAMPLES]
    files = [path for path in files if path.parts[1] != "verification"]  # runs of other programs, for tests alone
    with lzma.open(archive, "w") as whole, ZipFile(whole, "w") as packed:
        for path in sorted(files, key=lambda path: (path.suffix, path.as_posix())):
            packed.writestr(ZipInfo(path.relative_to("examples").as_posix()), path.read_bytes())


zlib.Z_DEFAULT_COMPRESSION = zlib.Z_BEST_COMPRESSION  # of wheels, for which setuptools has no option
setup(cmdclass={"build_py": BuildWithData})
