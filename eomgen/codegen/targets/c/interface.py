"""The interface that all compiled models share: one text is both the cdef for cffi and a C header.

``eomgen_call`` evaluates one function for ``count`` samples. Input ``j`` (in the order of the function's inputs) of
sample ``i`` starts at ``inputs[j] + i * strides[j]``; a stride of 0 gives all samples the same values. Outputs are
contiguous, sample after sample.
A complex model takes and gives pairs of doubles; strides count doubles.
"""

from __future__ import annotations

from eomgen.integrators.stepper_layout import STEPPER_CDEF

#: Signatures that never change from scene to scene, so that the wrapper around them is compiled once per machine.
INTERFACE_CDEF = f"""\
const char *eomgen_fingerprint(void);
const char *eomgen_number_type(void);
long eomgen_size(int what);
int eomgen_call(int function, long count, const double *const *inputs, const long *strides, double *const *outputs);
{STEPPER_CDEF}"""

#: Meaning of the argument of ``eomgen_size``.
SIZES = ("functions", "q", "v", "z", "u", "p", "lam", "bodies", "base")
