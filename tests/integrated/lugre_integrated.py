"""A mass with LuGre friction by numerical integration.

Equations 7 to 9 of the article, with alpha = 1. The field has a kink at v = 0: mode 0 moves with v > 0, mode
1 with v < 0, and each is smooth beyond. Observables: 0 is v, 1 is z.
"""

from __future__ import annotations

from dataclasses import replace

from contfric.flow.integrated import TOLERANCE
from contfric.models.generated.build import load_module
from contfric.models.reading.describe import describe

NAMES = ("Omega", "S", "S0", "sigma0", "sigma1", "c", "vS")
LUGRE = {
    "name": "lugre-by-sides",
    "states": ["x", "v", "z"],
    "parameters": dict.fromkeys(NAMES, 1.0),
    "period": "2*pi/Omega",
    "define": {
        "g": "S + (S0 - S)*exp(-abs(v)/vS)",
        "dz": "v - sigma0*abs(v)/g*z",
    },
    "observables": {"v": "v", "z": "z"},
    "surfaces": {"v": {"observable": "v", "level": 0}},
    "field": {"x": "v", "v": "cos(Omega*t) - x - sigma0*z - sigma1*dz - c*v", "z": "dz"},
    "modes": {"forwards": {"in": {"v": "+"}}, "backwards": {"in": {"v": "-"}}},
    "integration": {"method": "automatic"},
    "spread": {"x": 1, "v": 1, "z": "1/sigma0"},
}
MODULE = load_module(describe(LUGRE).text)
FUNCTIONS = replace(MODULE.functions(TOLERANCE), sides={(0, 0): 1, (1, 0): -1})
field, level, observe, rate = MODULE.field, MODULE.level, MODULE.observe, MODULE.rate
FLOW = FUNCTIONS.flow(level)
flow, hit, stationary = FLOW.flow, FLOW.hit, FLOW.stationary
