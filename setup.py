"""Packaging only: puts templates and examples, which stand at the top, into the package: _templates, _examples."""

from collections.abc import Callable, Iterable
from pathlib import Path
from shutil import copytree, ignore_patterns

from setuptools import setup
from setuptools.command.build_py import build_py

#: Endings of files of examples in the wheel: pictures would take ten times its room.
_OF_EXAMPLES = (".c", ".csv", ".md", ".py", ".toml", ".urdf")
Ignored = Callable[[str, list[str]], Iterable[str]]


def _all_but_examples(folder: str, names: list[str]) -> list[str]:
    """Return the names in a folder that are neither files of examples nor folders of such files."""
    return [name for name in names if not (name.endswith(_OF_EXAMPLES) or _is_folder(Path(folder, name)))]


def _is_folder(path: Path) -> bool:
    return path.is_dir() and path.name != "__pycache__"


class BuildWithData(build_py):
    """The ordinary build, plus the templates that the installed package renders, and the examples that it copies."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            self._add("templates", ignore_patterns("__pycache__"))
            self._add("examples", _all_but_examples)

    def _add(self, name: str, ignored: Ignored) -> None:
        copytree(name, Path(self.build_lib) / "eomgen" / f"_{name}", dirs_exist_ok=True, ignore=ignored)


setup(cmdclass={"build_py": BuildWithData})
