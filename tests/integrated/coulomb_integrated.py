"""The Coulomb oscillator by numerical integration: the bundled file, though its modes have a closed form."""

from __future__ import annotations

import json
from dataclasses import replace

import contfric as cf
from contfric.flow.integrated import TOLERANCE
from contfric.flow.interface import CompiledFlow
from contfric.models.generated.build import load_module

SPEED = 1


def with_method(definition: str, method: str) -> str:
    """Return the definition of a model whose modes are integrated, also those that are affine."""
    return json.dumps({**json.loads(definition), "integration": {"method": method}})


MODULE = load_module(with_method(cf.load_model("coulomb-yaml").definition, "automatic"))
#: Neither mode is stiff. A slide leaves v = 0 to its own side.
FUNCTIONS = replace(
    MODULE.functions(TOLERANCE), method="explicit", sides={(0, SPEED): 1, (1, SPEED): -1}
)
field, level, observe, rate = MODULE.field, MODULE.level, MODULE.observe, MODULE.rate


def compiled_flow() -> CompiledFlow:
    return FUNCTIONS.flow(level)


FLOW = compiled_flow()
flow, hit, stationary = FLOW.flow, FLOW.hit, FLOW.stationary
