"""Tangents of tape nodes: derivatives by direction number, structural zeros omitted."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.tape import Ref

Tangent = dict[int, Ref]  # direction -> derivative; directions with a derivative of zero by structure are absent


def signed_tangent(tangents: Mapping[int, Tangent], ref: Ref) -> Tangent:
    """Return the tangent of a reference, given the tangents of nodes."""
    tangent = tangents.get(abs(ref), {})
    return tangent if ref > 0 else {direction: -derivative for direction, derivative in tangent.items()}
