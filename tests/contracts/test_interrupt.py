"""Ctrl-C acts at once, wherever it comes: a process is interrupted at random times in every long call."""

from __future__ import annotations

import importlib
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

import contfric as cf
from contfric.atlas.exploration import Exploration
from contfric.base.interrupts import held_back
from contfric.curves.of_quantities.step import _Called

#: Time after the signal within which a call has returned (s); on an idle machine it is a tenth of that.
AT_ONCE = 3.0

#: Time after which the process tells where it is and ends, if a signal was lost (s).
LOST = 150

SCRIPT = """
import faulthandler
import sys
import numpy as np
import contfric as cf
from contfric.censuses.sweep import sweep
from contfric.chaos.cells import follow_cells
from contfric.continuation.core.locate import locate
from contfric.continuation.core.march import march
from contfric.curves.core.bracket import locate_on_curve
from contfric.curves.core.march import march_curve
from contfric.simulation.march import simulate
from contfric.response.capture import capture
from contfric.response.section import cut_solutions

kernels = (sweep, follow_cells, locate, march, locate_on_curve, march_curve, simulate, capture, cut_solutions)
for kernel in kernels:
    kernel.dispatcher  # compiled before anything is interrupted
model, start, parameter, bounds, other, span = {
    "coulomb": ("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.3, 0.7), "S", (0.2, 0.4)),
    "popp": ("popp", {"omega": 1.72}, "omega", (1.6, 1.9), "F", (0.06, 0.15)),
}[sys.argv[1]]
orbit = cf.find_orbit(model, start)
narrow = cf.explore(orbit, parameter, (0.48, 0.55) if model == "coulomb" else (1.7, 1.75), max_periods=2)
box = {parameter: bounds, other: span}
event = next(b for b in narrow.bifurcations if b.kind.value in ("SN", "BP", "PD", "CS", "GS"))
bridge = next((b for b in narrow.branches if b.bridge), None)
plane = {name: np.linspace(-1, 1, 400) for name in cf.load_model(model).states[:2]}
other_params = {name: value for name, value in start.items() if name != parameter}
grid = {parameter: np.linspace(*bounds, 60), other: np.linspace(*span, 60)}

def cut(*ends):
    return any(end.reason.name == "INTERRUPTED" for end in ends)

# each call, and whether its result says that it was interrupted; None: it raises KeyboardInterrupt
calls = {
    "find_orbit": (lambda: cf.find_orbit(model, start, longest=10**6), None),
    "simulate": (lambda: cf.simulate(model, start, periods=1e7), None),
    "continue_orbit": (
        lambda: cf.continue_orbit(orbit, parameter, bounds, max_step=1e-6), lambda b: cut(*b.ends)
    ),
    "explore": (lambda: cf.explore(orbit, parameter, bounds, max_periods=8), lambda d: not d.complete),
    "continue_bifurcation": (
        lambda: cf.continue_bifurcation(event, (parameter, other), box, max_step=1e-5), lambda c: cut(*c.ends)
    ),
    "continue_quantity": (
        lambda: cf.continue_quantity(orbit, "x_max", orbit.x_max, (parameter, other), box, max_step=1e-5),
        lambda c: cut(*c.ends),
    ),
    "continue_called": (
        lambda: cf.continue_quantity(orbit, "rms(x)", orbit.quantity("rms(x)"), (parameter, other), box,
                                     max_step=1e-4), lambda c: cut(*c.ends)
    ),
    "explore_plane": (
        lambda: cf.explore_plane(orbit, (parameter, other), box, max_sections=2), lambda p: not p.complete
    ),
    "census": (lambda: cf.census(model, start), lambda c: c.interrupted),
    "lyapunov_map": (
        lambda: cf.lyapunov_map(model, grid, start, periods=10000), lambda m: not m.complete
    ),
    "lyapunov_exponent": (
        lambda: cf.lyapunov_exponent(model, start, periods=10**7, tolerance=0.0, confirm=10**7), None
    ),
    "sweep": (
        lambda: cf.sweep(model, parameter, np.linspace(*bounds, 20000), other_params, transient=500),
        lambda s: not s.complete,
    ),
    "basins": (lambda: cf.basins(model, plane, start), lambda b: not b.complete),
    "poincare": (lambda: cf.poincare(model, start, periods=1e7), None),
    "verify": (lambda: narrow.verify(), None),
    "period_adding": (lambda: cf.period_adding(bridge, longest=8) if bridge else None, None),
}
faulthandler.enable()
faulthandler.dump_traceback_later(float(sys.argv[2]), exit=True)
for name in sys.argv[3:]:
    call, was_cut = calls[name]
    print("go", name, flush=True)
    try:
        while True:
            found = call()
            if was_cut is not None and was_cut(found):
                break
        print("kept", name, flush=True)
    except KeyboardInterrupt:
        print("raised", name, flush=True)
"""
KEPT = (
    "continue_orbit",
    "explore",
    "continue_bifurcation",
    "continue_quantity",
    "continue_called",
    "explore_plane",
    "census",
    "lyapunov_map",
    "sweep",
    "basins",
)
RAISED = ("find_orbit", "simulate", "lyapunov_exponent", "poincare", "verify", "period_adding")


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal sends them")
@pytest.mark.parametrize("model", ["coulomb", pytest.param("popp", marks=pytest.mark.slow)])
def test_ctrl_c_acts_at_once(model: str) -> None:
    draw = random.Random(f"{model} {os.environ.get('CONTFRIC_SIGINT_SEED', '')}")
    # a census is offered for the first model only, and there are no bridges in the second
    missing = () if model == "coulomb" else ("census", "period_adding")
    calls = [name for name in (*KEPT, *RAISED) if name not in missing]
    # its own group: a signal for the tests does not reach it
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, model, str(LOST), *calls],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    try:
        for name in calls:
            assert process.stdout.readline().split() == ["go", name], process.communicate()[1]
            time.sleep(draw.uniform(0.05, 0.6))
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            how = process.stdout.readline().split()
            took = time.monotonic() - began
            # between two calls there is nothing to keep
            assert how in (["kept", name], ["raised", name]), process.communicate()[1]
            assert took < AT_ONCE, (name, took)
            if os.environ.get("CONTFRIC_SIGINT_SEED"):
                print(model, *how, f"{took:.2f} s")
    finally:
        process.kill()
        process.communicate()


# ------------------------------------------------------------------- where Python itself loses Ctrl-C

#: A package whose first import takes its time, and which cannot be imported twice (as some of scipy's).
FRAGILE = """
import sys, time
from fragile import part
if "kept" in vars(sys):
    del later
sys.kept = True
time.sleep(0.2)
later = 1
"""


def _interrupt_in(seconds: float) -> threading.Timer:
    timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    return timer


@pytest.mark.parametrize("seconds", [0.02, 0.1, 0.15])
def test_an_import_is_finished_first(tmp_path, monkeypatch, seconds) -> None:
    (tmp_path / "fragile").mkdir()
    (tmp_path / "fragile" / "__init__.py").write_text(FRAGILE, encoding="utf-8")
    (tmp_path / "fragile" / "part.py").write_text("", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delattr(sys, "kept", raising=False)
    for name in ("fragile", "fragile.part"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    before = signal.getsignal(signal.SIGINT)
    timer = _interrupt_in(seconds)
    with pytest.raises(KeyboardInterrupt), held_back():
        importlib.import_module("fragile")
    timer.join()
    assert sys.modules["fragile"].later == 1
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_comes_where_the_block_lets_it() -> None:
    timer, done = _interrupt_in(0.05), []
    with pytest.raises(KeyboardInterrupt), held_back() as now:
        time.sleep(0.2)
        done.append("not cut")
        now()
        done.append("cut")
    timer.join()
    assert done == ["not cut"]


def test_other_threads_have_no_handlers() -> None:
    found = []

    def block() -> None:
        with held_back():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=block)
    thread.start()
    thread.join()
    assert found == [signal.getsignal(signal.SIGINT)]


@pytest.mark.parametrize("at", range(7))
def test_a_diagram_is_whole_wherever_it_is_cut(monkeypatch, at) -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    monkeypatch.setattr(Exploration, "judge", _cutting(Exploration.judge, at))
    found = cf.explore(orbit, "Omega", (0.4, 0.6))
    assert not found.complete
    assert "interrupted" in found.notes
    for event in found.events:
        for proposal in event.proposals:
            if proposal.branch is not None:  # what a proposal became is there
                assert 0 <= proposal.branch < len(found.branches)


def _cutting(judge, at: int):
    """A method that does what it did, and at its call number ``at`` gets a Ctrl-C."""
    calls = []

    def cut(*args, **kwargs):
        result = judge(*args, **kwargs)
        calls.append(1)
        if len(calls) == at + 1:
            signal.raise_signal(signal.SIGINT)
        return result

    return cut


def test_ctrl_c_as_compiled_code_calls_python_ends_a_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the first line of such a function nothing can be caught, and what is raised is only printed."""
    call, box = _Called._call, {"Omega": (0.45, 0.52), "S": (0.3, 0.34)}
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    held = orbit.quantity("rms(x)")

    def interrupted(self: _Called, number: int) -> int:
        os.kill(os.getpid(), signal.SIGINT)
        return call(self, number)

    monkeypatch.setattr(_Called, "_call", interrupted)
    try:
        curve = cf.continue_quantity(orbit, "rms(x)", held, ("Omega", "S"), box)
    except KeyboardInterrupt:
        return  # before there is a point to keep
    assert cf.CurveEndReason.INTERRUPTED in {end.reason for end in curve.ends}
