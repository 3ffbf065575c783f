"""Proofs: how many random orbits, which events and how much of a branch are proved, and what no cheat passes.

python -m benchmarks.certificates orbits 1000      random scenes of coulomb: share proved, by class
python -m benchmarks.certificates models 100       random orbits of declared models and structures, by class
python -m benchmarks.certificates events           the events of several diagrams, by kind
python -m benchmarks.certificates branches         the branches of Fig. 5, share of the arclength
python -m benchmarks.certificates diagram          the whole of Fig. 5, and the check of its file
python -m benchmarks.certificates figures DIR      Figs. 4, 5, 6, 7, 13 of the paper, with their files
python -m benchmarks.certificates chaos            horseshoes of the release map in the plane of Fig. 9
python -m benchmarks.certificates census           ten values of Omega of Fig. 5: nothing else is there
python -m benchmarks.certificates cheats 10000     changed certificates: how many are verified
python -m benchmarks.certificates laws 1000        the same of declared models, whose files state the law
python -m benchmarks.certificates horseshoes 100   changed horseshoes: how many false ones are proved
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import contfric as cf
from contfric.certify.files import certificate_data
from contfric.certify.tubes.tube_file import tubes_of
from contfric.errors import ContfricError
from contfric.models.balls.build import ball_model
from contfric.verify.file import check_text
from contfric.verify.piecewise import check_text as check_law
from tests import release_oracle, tube_oracle
from tests.certificate_oracle import false_statements, mutated
from tests.contracts.test_event_files import KINDS, files
from tests.event_oracle import changed, false_event
from tests.law_oracle import false_law_statements, mutated_law

SCENES: dict[str, tuple[dict[str, float], str, tuple[float, float]]] = {
    "Omega (Fig. 5)": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "S": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "S", (0.03, 0.39)),
    "h": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "h", (-0.3, 0.3)),
    "zeta": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "zeta", (-0.1, 1.3)),
    "S0": ({"Omega": 0.6, "S": 0.3, "S0": 0.35}, "S0", (0.3, 0.8)),
    "large limits": ({"Omega": 0.6, "S": 0.3, "S0": 0.5}, "Omega", (0.35, 0.9)),
    "three periods": ({"Omega": 0.4, "S": 0.1, "S0": 0.25}, "Omega", (0.2, 0.9)),
}


def random_params(rng: np.random.Generator) -> dict[str, float]:
    """Return a scene: resonances, no damping and S = S0 among them."""
    limit = rng.uniform(0.02, 0.9)
    omegas = [rng.uniform(0.1, 2.0), 1.0, 0.5, 1 / 3, 0.25]
    dampings = [0.0, rng.uniform(0.0, 0.3), 1.0, rng.uniform(1.0, 5.0)]
    return {
        "Omega": float(rng.choice(omegas, p=[0.7, 0.1, 0.1, 0.05, 0.05])),
        "S": float(limit * rng.choice([1.0, rng.uniform(0.3, 1.0)])),
        "S0": float(limit),
        "h": float(rng.choice([0.0, rng.uniform(-0.5, 0.5)])),
        "zeta": float(rng.choice(dampings, p=[0.4, 0.4, 0.05, 0.15])),
    }


def orbits(count: int) -> None:
    """Random orbits of random scenes: proved, and checked."""
    rng = np.random.default_rng(19)
    found: Counter[str] = Counter()
    proving, checking = [], []
    while sum(found.values()) < count:
        params = random_params(rng)
        try:
            orbit = cf.find_orbit("coulomb", params, state=rng.normal(size=2), longest=2000)
        except ContfricError:
            continue
        begin = time.process_time()
        certificate = orbit.certify()
        proving.append(time.process_time() - begin)
        if not certificate.proved:
            found[certificate.why.split(";")[0]] += 1
            print(params, orbit.name, certificate.why)
            continue
        text = json.dumps(certificate_data(certificate))
        begin = time.process_time()
        answer = check_text(text)
        checking.append(time.process_time() - begin)
        found["proved and verified" if answer.yes else f"proved, but: {answer.why}"] += 1
    for what, number in found.most_common():
        print(f"{number:6d}  {what}")
    for name, seconds in (("prover", proving), ("checker", checking)):
        print(f"{name}: median {1e3 * np.median(seconds):.1f} ms, most {max(seconds):.3f} s")


#: Folders of declared models: bundled ones, those of tests and of stress runs.
MODELS = ("contfric/models/bundled", "tests/models", "benchmarks/stress/typed")


def models(count: int) -> None:
    """Random orbits of declared models: parameters moved by up to a fifth, from random states."""
    rng = np.random.default_rng(20)
    root = Path(__file__).resolve().parents[1]
    files = sorted(path for folder in MODELS for path in (root / folder).glob("*.yaml"))
    found: Counter[str] = Counter()
    refused: dict[str, str] = {}
    offered: dict[str, Any] = {}
    seconds, checking = list[float](), list[float]()
    for path in files:
        try:
            model = cf.load_model(path)
            ball_model(model, model.defaults)
            offered[path.stem] = model
        except ContfricError as error:
            refused[path.stem] = str(error)
    for name, model in offered.items():
        for _ in range(math.ceil(count / len(offered))):
            params = {k: v * rng.uniform(0.8, 1.2) for k, v in model.defaults.items()}
            try:
                state = rng.normal(size=len(model.states))
                orbit = cf.find_orbit(model, params, state=state, longest=500)
            except ContfricError:
                continue
            begin = time.process_time()
            certificate = orbit.certify()
            seconds.append(time.process_time() - begin)
            what = "proved" if certificate.proved else certificate.why.split(";")[0]
            if certificate.proved:
                try:
                    text = json.dumps(
                        certificate_data(certificate)
                    )  # of those that are verified only
                    begin = time.process_time()
                    what += ", and verified" if check_law(text).yes else ", and refused"
                    checking.append(time.process_time() - begin)
                except ContfricError as error:
                    what += f"; no file: {error}"
            found[what] += 1
            if not certificate.proved:
                print(f"{name}: {params} {orbit.name}: {certificate.why}", flush=True)
        print(f"{name}: {dict(found)} so far", flush=True)
    for what, number in found.most_common():
        print(f"{number:6d}  {what}")
    print(f"offered for {len(offered)} models, refused for {len(refused)}:")
    for name, why in refused.items():
        print(f"{name}: {why}")
    for who, times in (("prover", seconds), ("checker", checking)):
        print(
            f"{who}: {sum(times):.1f} s, median {np.median(times):.3f} s, most {max(times):.2f} s"
        )


def events() -> None:
    """Events of diagrams, by kind."""
    found: Counter[tuple[str, str]] = Counter()
    widest, off = 0.0, 0.0
    for name, (params, parameter, span) in SCENES.items():
        diagram = cf.explore(cf.find_orbit("coulomb", params), parameter, span)
        begin = time.perf_counter()
        certificates = [event.certify(parameter) for event in diagram.bifurcations]
        seconds = time.perf_counter() - begin
        for c in certificates:
            holds = ", orbit with holds" if c.event.orbit.system.holds else ""
            found[c.event.kind.value, "proved" if c.proved else f"{c.why}{holds}"] += 1
            if c.proved:
                widest, off = max(widest, c.radius), max(off, c.error)
        proved = sum(c.proved for c in certificates)
        print(f"{name}: {proved} of {len(certificates)} events proved in {seconds:.2f} s")
    for (kind, what), number in sorted(found.items()):
        print(f"{number:6d}  {kind:3s} {what}")
    print(f"widest ball {widest:.1e}; printed parameters are off by {off:.1e} at most")


def branches() -> None:
    """Branches of Fig. 5: boxes, and the share of the arclength that they cover."""
    params, parameter, span = SCENES["Omega (Fig. 5)"]
    whole, covered = 0.0, 0.0
    for branch in cf.explore(cf.find_orbit("coulomb", params), parameter, span).branches:
        begin = time.perf_counter()
        certificate = branch.certify()
        seconds = time.perf_counter() - begin
        length = float(branch.arc[-1] - branch.arc[0])
        whole, covered = whole + length, covered + length * certificate.covered
        print(f"{certificate!r}, {100 * certificate.regular:.4g} % without events, {seconds:.1f} s")
        for gap in certificate.gaps[:3] + certificate.gaps[3:][-2:]:
            print("   ", gap)
    print(f"{100 * covered / whole:.3f} % of the arclength of the diagram")


def diagram() -> None:
    """The whole diagram of Fig. 5: events and branches, on one core, and its check."""
    params, parameter, span = SCENES["Omega (Fig. 5)"]
    found = cf.explore(cf.find_orbit("coulomb", params), parameter, span)
    begin, busy = time.perf_counter(), time.process_time()
    certificate = found.certify()
    print(certificate)
    print(
        f"{time.perf_counter() - begin:.1f} s, {time.process_time() - busy:.1f} s of the processor"
    )
    text = json.dumps({"certificate": "diagram", "format": 1, "checkable": certificate.checkable})
    busy = time.process_time()
    print(f"{check_text(text)}, {time.process_time() - busy:.1f} s of the processor")


#: Studies of the diagrams of the paper, and seconds after which a proof of one is ended.
FIGURES, LIMIT = ("fig06", "fig07", "fig13", "fig04", "fig05"), 600.0


def figures(folder: str) -> None:
    """The diagrams of the paper, with their events and branches, on one core."""
    import tempfile
    from pathlib import Path

    for name in FIGURES:
        with tempfile.TemporaryDirectory() as out:
            cf.run_study(name, out=out)
            found = cf.load(Path(out) / "diagram.npz")
        begin, busy = time.perf_counter(), time.process_time()
        certificate = found.certify(time_limit=LIMIT)
        spent = time.perf_counter() - begin, time.process_time() - busy
        certificate.save(Path(folder) / f"{name}.json")
        print(f"{name}: {certificate}")
        print(f"{spent[0]:.1f} s, {spent[1]:.1f} s of the processor", flush=True)


#: In the plane of Fig. 9: (Omega, S), and the most returns of a horseshoe.
CHAOTIC = ((0.282, 0.122, 6), (0.292, 0.126, 6), (0.288, 0.129, 9), (0.396, 0.082, 6))


def chaos() -> None:
    """Horseshoes of the release map in chaotic regions of the plane of Fig. 9."""
    for omega, s, most in CHAOTIC:
        params = {"Omega": omega, "S": s, "S0": 0.4}
        begin = time.process_time()
        found = cf.release_map("coulomb", params, count=8000).horseshoe(most)
        print(f"{params}: {found}; {found.pieces} pieces, {time.process_time() - begin:.1f} s")


def census() -> None:
    """All period-1 orbits with a stick at ten values of Omega of Fig. 5 (and one in the gap of a bridge)."""
    for omega in (0.41, 0.43, 0.45, 0.47, 0.48, 0.4918, 0.5, 0.52, 0.54, 0.58):
        begin = time.process_time()
        found = cf.certify_census("coulomb", {"Omega": omega, "S": 0.32, "S0": 0.4})
        print(f"{found}\n  {found.intervals} intervals, {time.process_time() - begin:.1f} s")


def cheats(count: int) -> None:
    """Change true certificates of orbits, events and tubes, and decide by 60 digits those that are verified.

    Each case has its own seed and is a line of ``cheats.txt``: a run that was ended goes on there.
    """
    done = Path("cheats.txt")
    known = done.read_text().splitlines() if done.exists() else []
    begin = time.process_time()
    true = {"orbit": _certificates(np.random.default_rng(23)), "tube": _tubes()}
    true |= {kind: [text] for kind, text in files().items()}
    with done.open("a") as out:
        for k in range(len(known), count):
            rng = np.random.default_rng([23, k])
            kind = "tube" if k % 20 == 19 else KINDS[k // 2 % 9] if k % 2 else "orbit"
            data: dict[str, Any] = json.loads(true[kind][k // 2 % len(true[kind])])
            change, is_false = _CHEATS.get(kind, (changed, false_event))
            data = change(data, rng)
            verdict = "refused"
            if check_text(json.dumps(data)).yes:
                verdict = "VERIFIED, BUT FALSE" if is_false(data) else "verified, and true"
            known.append(f"{kind}: {verdict}")
            print(known[-1], file=out, flush=True)
    print(Counter(known), f"{time.process_time() - begin:.1f} s of the processor")


#: Impacts, sticks with excitation and without, a relay, a firing, a heater, a rocking block.
LAWS = (
    *("impact", "dead-band", "relay", "integrate-and-fire", "thermostat", "rocking-block"),
    "coulomb-yaml",
)


def laws(count: int) -> None:
    """Change true certificates of declared models, their laws among what is changed."""
    found, begin = Counter[str](), time.process_time()
    true = [certificate_data(cf.find_orbit(name).certify()) for name in LAWS]
    for k in range(count):
        data = mutated_law(true[k % len(true)], np.random.default_rng([31, k]))
        verdict = "refused"
        if check_law(json.dumps(data)).yes:
            wrong = false_law_statements(data)
            verdict = f"VERIFIED, BUT FALSE: {wrong}" if wrong else "verified, and true"
        found[verdict] += 1
    print(dict(found), f"{time.process_time() - begin:.1f} s of the processor")


def horseshoes(count: int) -> None:
    """Change a true horseshoe, and try to prove the statements that are false in 60 digits."""
    rng, found, begin = np.random.default_rng(29), Counter[str](), time.process_time()
    for _ in range(count):
        stated = release_oracle.changed(release_oracle.STATED, rng)
        wrong = release_oracle.false_intervals(stated)
        proved = any(release_oracle.proves(stated, interval) for interval in wrong)
        found["PROVED, BUT FALSE" if proved else "false, refused" if wrong else "true"] += 1
    print(dict(found), f"{time.process_time() - begin:.1f} s of the processor")


def _changed_tube(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    return tube_oracle.changed(tube_oracle.cut(data, rng), rng)


_CHEATS: dict[str, tuple[Any, Any]] = {
    "orbit": (mutated, false_statements),
    "tube": (_changed_tube, tube_oracle.false_tube),
}


def _tubes() -> list[str]:
    """Return tubes of Fig. 5: with a fold and two ends, with a branch point, without an event."""
    found = []
    for name, omega, span in (
        ("1a", 0.54, (0.4, 0.6)),
        ("2s", 0.5, (0.485, 0.6)),
        ("0s", 0.55, (0.5, 0.56)),
    ):
        orbit = cf.solve_orbit("coulomb", name, {"Omega": omega, "S": 0.32, "S0": 0.4})
        branch = cf.continue_orbit(orbit, "Omega", span)
        found += [json.dumps(tube) for tube in tubes_of(branch.certify())]
    return found


def _certificates(rng: np.random.Generator) -> list[str]:
    found: list[str] = []
    while len(found) < 40:
        try:
            orbit = cf.find_orbit("coulomb", random_params(rng), longest=2000)
        except ContfricError:
            continue
        certificate = orbit.certify()
        if certificate.proved and len(orbit.joints) < 9:
            found.append(json.dumps(certificate_data(certificate)))
    return found


if __name__ == "__main__":
    task, *counts = sys.argv[1:] or ["orbits"]
    tasks = {"orbits": orbits, "cheats": cheats, "models": models, "horseshoes": horseshoes}
    tasks["laws"] = laws
    if task == "figures":
        figures(counts[0] if counts else ".")
    elif task in tasks:
        tasks[task](int(counts[0]) if counts else 100)
    else:
        others = {"events": events, "branches": branches, "diagram": diagram, "chaos": chaos}
        (others | {"census": census})[task]()
