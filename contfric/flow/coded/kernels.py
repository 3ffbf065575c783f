"""The functions of models whose formulas are data: compiled once, for all of them."""

from __future__ import annotations

from contfric.compiled import (
    Kernel,
    field_signature,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    reset_signature,
    scale_signature,
)
from contfric.flow.coded import series, values
from contfric.flow.coded.tables import CODED
from contfric.flow.layouts import AFFINE
from contfric.handle import with_handle

_VALUES = {
    "field": field_signature,
    "observe": observe_signature,
    "rate": rate_signature,
    "period": period_signature,
    "scale": scale_signature,
    "onto": field_signature,
    "level": level_signature,
    "reset": reset_signature,
}
#: The kernels of models whose formulas are data, by what they are to a flow.
KERNELS = {
    name: Kernel(getattr(module, name), with_handle(signature, CODED), vectors=name == "carry")
    for module, signatures in ((series, AFFINE), (values, _VALUES))
    for name, signature in signatures.items()
}
