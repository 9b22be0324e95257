"""Demos of examples: as modules, and as the programs that users run."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

EXAMPLES = Path(__file__).parents[2] / "examples"


def demo_module(name: str, file: str = "demo.py") -> ModuleType:
    """Return the demo of an example, or another program of it, as a module."""
    spec = importlib.util.spec_from_file_location(f"{name}_demo", EXAMPLES / name / file)
    assert spec is not None and spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run_demo(name: str, *arguments: object, exit_code: int = 0) -> str:
    """Return what a demo prints, to stderr if it is to fail."""
    command = [sys.executable, str(EXAMPLES / name / "demo.py"), *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(EXAMPLES.parent)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == exit_code, done.stderr
    return done.stderr if exit_code else done.stdout
