"""Notes on delays and times between samples that a scene has as plain numbers: they are in s, and may be meant as
numbers of samples, or as frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.base.text import key_of
from eomgen.scene.document.schema import Document

#: Samples of a delay from which on a whole number of seconds may have been meant as a number of samples.
_MANY_SAMPLES = 50
#: Time between samples, written without a unit, from which on a frequency may have been meant, s.
_RARE = 10.0


def doubtful_times(data: Mapping[str, Any], document: Document) -> list[str]:
    """Return a note on each delay of many samples, written as a whole number without a unit: s, and no samples; and
    on each time between samples that looks like a frequency.

    Parameters
    ----------
    data : of ``document`` as it is written: unit strings are not converted
    """
    notes = []
    for section in ("states", "controllers"):
        for name, entry in document.section(section).items():
            delay, period = data[section][name].get("delay"), entry.sample
            written = data[section][name].get("sample")
            if isinstance(written, int | float) and written >= _RARE:
                note = f"the time between two samples is {written:g} s"
                notes.append(f'{key_of(section, name)}.sample: {note}; {written:g} a second are "{1 / written:.6g} s"')
            if not (isinstance(delay, int | float) and isinstance(period, int | float)):
                continue
            if float(delay).is_integer() and delay >= _MANY_SAMPLES * period:
                note = f"the delay {delay:g} is {delay:g} s, {delay / period:.4g} samples"
                notes.append(
                    f"{key_of(section, name)}.delay: {note}: times without a unit are in s, and one sample is"
                    f' "{period:.6g} s"'
                )
    return notes
