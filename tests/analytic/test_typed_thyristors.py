"""Resets that end sliding into one of several modes on its sides: a thyristor fired in either direction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

#: S. G. Jalali, I. Dobson, R. H. Lasseter, G. Venkataramanan, Switching time bifurcations in a thyristor
#: controlled reactor, IEEE Trans. Circuits Syst. I 43 (1996) 209-218. Pulses come every half period; the
#: thyristors stop conducting when the current of the reactor comes to 0.
REACTOR = """
name: reactor
states: [il, vc, ir]
parameters: {{w: 1.0, Ls: 0.2, Rs: 0.05, C: 1.5, Lr: 0.4, Rr: 0.03, phi: 1.8}}
period: 2*pi/w
define: {{source: (sin(w*t) - vc - Rs*il)/Ls, coil: (vc - Rr*ir)/Lr}}
surfaces:
  zero: {{observable: ir}}
  forward: {{observable: vc}}
  pulse: {{observable: sin(w*t - phi)}}
modes:
  up: {{in: {{zero: +}}, field: {{il: source, vc: (il - ir)/C, ir: coil}}}}
  down: {{in: {{zero: -}}, field: {{il: source, vc: (il - ir)/C, ir: coil}}}}
  off: {{in: {{zero: 0}}, field: {{il: source, vc: il/C, ir: 0}}}}
resets:
  pulse: {{to: {to}, from: [off]}}
symmetry: il -> -il, vc -> -vc, ir -> -ir, t -> t + T/2
"""
CHOSEN = "{up: {forward: +}, down: {forward: -}}"


def fired(phi: float, pulses: int) -> np.ndarray:
    """Return (il, vc) at the last of some pulses, from rest, by scipy."""

    def rates(t: float, y: np.ndarray, on: bool) -> list[float]:
        il, vc, ir = y
        coil = (vc - 0.03 * ir) / 0.4 if on else 0.0
        return [(np.sin(t) - vc - 0.05 * il) / 0.2, (il - on * ir) / 1.5, coil]

    t, y, exact = 0.0, np.zeros(3), {"rtol": 1e-11, "atol": 1e-13}
    for k in range(pulses):
        until = phi + k * np.pi
        if k:

            def stops(t: float, y: np.ndarray, on: bool) -> float:
                return y[2]

            stops.terminal, stops.direction = True, -np.sign(y[1])
            found = solve_ivp(rates, (t, until), y, args=(True,), events=stops, **exact)
            t, y = found.t[-1], found.y[:, -1] * [1.0, 1.0, 0.0]
        if t < until:
            found = solve_ivp(rates, (t, until), y, args=(False,), **exact)
            t, y = until, found.y[:, -1]
    return y[:2]


@pytest.mark.parametrize("phi", [1.7, 1.8, 2.0])
def test_a_thyristor_conducts_in_the_direction_of_its_voltage(tmp_path: Path, phi: float) -> None:
    model = typed(tmp_path, REACTOR.format(to=CHOSEN))
    orbit = cf.find_orbit(model, {"phi": phi})
    assert orbit.admissible and orbit.symmetric
    assert cf.Signature(model, orbit.signature.segments).segments  # it can be written down
    [pulse] = [
        joint
        for joint, (_, end) in zip(orbit.begins, np.roll(orbit.itinerary, 1, 0), strict=True)
        if end == "pulse" and joint[2] > 0.0
    ]
    assert pulse[1:3] == pytest.approx(fired(phi, 61), abs=1e-8)


def test_which_mode_a_pulse_leads_to_must_be_told(tmp_path: Path) -> None:
    with pytest.raises(cf.ModelError, match="could go on in down or up: tell by the sides"):
        typed(tmp_path, REACTOR.format(to="[up, down]"))
