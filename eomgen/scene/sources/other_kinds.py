"""Files with a key ``kind``, which are no mechanical scenes: rows of products of the group ``eomgen.file_kinds``."""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.base.products import fault_of_absent, rows_of
from eomgen.base.text import shown

GROUP = "eomgen.file_kinds"


@dataclass(frozen=True)
class OtherKind:
    """A kind of file beside mechanical scenes.

    Attributes
    ----------
    kind : value of the key
    noun : for messages, "a Hamiltonian system"
    remedy : uses of such a file, for messages
    """

    kind: str
    noun: str
    remedy: str


def fault_of_kind(kind: object) -> tuple[str, str] | None:
    """Return the fault of a key ``kind`` in a mechanical scene, and a remedy; None if the value means no other kind."""
    for row in rows_of(GROUP, OtherKind):
        if row.kind == kind:
            return f"this is {row.noun}, and this command or function is for mechanical scenes", row.remedy
    absent = fault_of_absent(str(kind))
    return absent and (f"there is no kind of file {shown(str(kind))}: {absent[0]}", absent[1])
