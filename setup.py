"""Packaging only: puts the top-level templates into the wheel as eomgen/_templates."""

from pathlib import Path
from shutil import copytree, ignore_patterns

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithTemplates(build_py):
    """The ordinary build, plus the templates that the installed package renders."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            folder = Path(self.build_lib) / "eomgen" / "_templates"
            copytree(Path("templates"), folder, dirs_exist_ok=True, ignore=ignore_patterns("__pycache__"))


setup(cmdclass={"build_py": BuildWithTemplates})
