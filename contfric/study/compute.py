"""The computing steps of a run: the first orbit, and what is done with it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.collect import FINAL
from contfric.atlas.diagram import Diagram, LooseEnd, Node
from contfric.atlas.plane import Plane
from contfric.continuation.branch import Branch
from contfric.continuation.events import EndReason
from contfric.orbit.orbit import Orbit
from contfric.study.read import Study
from contfric.study.schema import ContinueTask, ExploreTask, LyapunovTask, PlaneTask, Want

if TYPE_CHECKING:
    from contfric.chaos.map import LyapunovMap

Say = Callable[[str], None]


#: Kernels of the continuation; those that find an orbit are compiled meanwhile.
_CONTINUATION = ("contfric.continuation.march:march", "contfric.continuation.bracket:locate")


def compile_continuation() -> None:
    """Let a second process compile what a first continuation needs; nothing where it is cached."""
    from contfric.compiled import compile_aside

    compile_aside(_CONTINUATION)


def find_start(study: Study, say: Say) -> Orbit:
    """Return the first orbit: saved, solved for, or what a simulation converges to."""
    if study.orbit is not None:
        return study.orbit

    def heard(text: str) -> None:
        say(f"orbit: {text}")

    if study.signature is not None:
        from contfric.orbit.solve import solve_orbit

        say(f"orbit: solving for {study.signature.name or study.signature}")
        return solve_orbit(study.model, study.signature, study.params, progress=heard)
    from contfric.orbit.find import find_orbit

    how = study.content.start.simulate
    assert how is not None
    say("orbit: simulating")
    return find_orbit(
        study.model,
        study.params,
        how.periods,
        state=how.state,
        time=how.time,
        longest=how.longest,
        progress=heard,
    )


def explore_from(study: Study, orbit: Orbit, task: ExploreTask, say: Say) -> Diagram:
    """Explore; on Ctrl-C the diagram found so far, with ``complete`` False."""
    from contfric.atlas.explore import explore
    from contfric.atlas.seeds import Seeds

    options = task.options()
    if task.seeds is not None:
        options["seeds"] = Seeds(**task.seeds.model_dump())
    del options["verify"]
    diagram = explore(
        orbit,
        task.parameter,
        (task.range[0], task.range[1]),
        stability=study.wants(Want.STABILITY) or task.verify,  # without it branch points are missed
        progress=lambda text: say(f"explore: {text}"),
        **options,
    )
    if task.verify and diagram.complete:
        say("verify: explored again from its own branches")
        diagram.verify()
    return diagram


def continue_from(study: Study, orbit: Orbit, task: ContinueTask, say: Say) -> Branch:
    """Continue one branch."""
    from contfric.continuation.trace import continue_orbit

    return continue_orbit(
        orbit,
        task.parameter,
        (task.range[0], task.range[1]),
        stability=study.wants(Want.STABILITY),
        progress=lambda text: say(f"continue: {text}"),
        **task.options(),
    )


def lyapunov_from(study: Study, task: LyapunovTask, tiles: Path, say: Say) -> LyapunovMap:
    """Compute a map; finished tiles are kept until it is complete, and a killed run goes on from them."""
    import shutil

    from contfric.chaos.compute import lyapunov_map

    found = lyapunov_map(
        study.model,
        {name: np.linspace(low, high, int(n)) for name, (low, high, n) in task.grid.items()},
        {name: value for name, value in study.params.items() if name not in task.grid},
        folder=tiles,
        progress=lambda text: say(f"lyapunov: {text}"),
        **task.options(),
    )
    if found.complete:
        shutil.rmtree(tiles, ignore_errors=True)
    return found


def plane_from(study: Study, orbit: Orbit, task: PlaneTask, say: Say) -> Plane:
    """Explore a plane; on Ctrl-C what was found so far, with ``complete`` False."""
    from contfric.atlas.plane_explore import explore_plane
    from contfric.atlas.seeds import Seeds

    options = task.options()
    if task.seeds is not None:
        options["seeds"] = Seeds(**task.seeds.model_dump())
    return explore_plane(
        orbit,
        (task.parameters[0], task.parameters[1]),
        {name: (pair[0], pair[1]) for name, pair in task.range.items()},
        task.sections,
        progress=lambda text: say(f"plane: {text}"),
        **options,
    )


def one_branch(branch: Branch, bounds: tuple[float, float]) -> Diagram:
    """Return the diagram of a single branch: nothing follows its events."""
    return Diagram(
        model=branch.model,
        parameter=branch.parameter,
        range=bounds,
        branches=(branch,),
        nodes=tuple(Node(bifurcation, (0,)) for bifurcation in branch.bifurcations),
        loose_ends=tuple(
            LooseEnd(0, side, end)
            for side, end in enumerate(branch.ends)
            if end.reason not in FINAL
        ),
        complete=all(end.reason is not EndReason.INTERRUPTED for end in branch.ends),
    )


def was_interrupted(diagram: Diagram) -> bool:
    """Tell whether Ctrl-C ended a computation (a limit such as ``max_branches`` does not count)."""
    ends = (end.reason for branch in diagram.branches for end in branch.ends)
    return EndReason.INTERRUPTED.value in diagram.notes or EndReason.INTERRUPTED in ends
