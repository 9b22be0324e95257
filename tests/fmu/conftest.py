"""Every FMU that a test exports is held to the rules of its standard."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from eomgen.products.fmu import export
from tests.fmu.checks import findings


@pytest.fixture(autouse=True, scope="session")
def _checked_exports() -> Iterator[None]:
    files_of = export.FmuFiles

    def check(interface: Any, files: Mapping[str, str | bytes]) -> Any:
        assert findings(files) == []
        return files_of(interface, files)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(export, "FmuFiles", check)
        yield
