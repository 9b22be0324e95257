"""Messages with many problems of one kind have the first of them, their number, and all others."""

from __future__ import annotations

import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import from_data


def test_formulas_in_place_of_tables_are_counted() -> None:
    data = {
        "format": 1,
        "name": "arm",
        "bodies": {"b": {"mass": 1, "inertia": [1, 1, 1]}},
        "joints": {"j": {"type": "revolute", "axis": [0, 0, 1], "parent": "base", "child": "b"}},
        "outputs": {f"e{k}": f"{k} * q.j" for k in range(45)},
        "forces": {"push": {"body": "b", "force": [1, 0]}},
    }
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    assert len(caught.value.problems) == 46
    lines = str(caught.value).splitlines()
    assert lines[0] == "description error: 46 problems" and len(lines) == 4
    assert "outputs.e0): a table is needed here, not '0 * q.j'; try: e0 = { formula" in "\n".join(lines)
    assert sum(line.startswith("     and 44 more like it: ") and line.endswith(", ...") for line in lines) == 1
    assert any("forces.push.force" in line for line in lines)
