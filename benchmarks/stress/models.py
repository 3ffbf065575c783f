"""Random diagrams of models other than ``coulomb``, explored again from up to six of their branches.

``python benchmarks/stress/models.py --count 300 --seed 1 --workers 2 --out models.json``

Each case is one of the bundled studies that explore, a model of ``tests/models``, or one of ``typed``: models
as users write them, with nothing said but their equations. Its parameters are moved by up to a fifth, and a
part of the range is explored. What is compared, excused and cut is as in :mod:`restarts`, whose scenes have
five parameters of one model. The scenes of each model are counted.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from chunks import Chunked
from restarts import Scene, chunk
from scenes import generator

import contfric as cf
from contfric.base.yaml_lines import read_yaml
from contfric.study.library import study_names, study_path

WHAT = "Diagrams of models other than coulomb, explored again from up to six of their branches."
MODELS = Path(__file__).resolve().parents[2] / "tests" / "models"
TYPED = Path(__file__).resolve().parent / "typed"
#: How far parameters are moved (relative), and the part of a study's range that is explored.
MOVED, PART = 0.2, (0.3, 1.0)
#: What a parameter that is zero is moved by, in such moves.
SMALL = 0.5
#: Longest that one scene may take with its restarts (s of processor time), and scenes of a chunk of work.
LIMIT, CHUNK = 60.0, 5
#: Draws of parameters until a model accepts them, and periods of a restart.
DRAWS, PERIODS = 20, 2


@cache
def bases(folders: tuple[Path, ...] = (MODELS,)) -> tuple[Scene, ...]:
    """Return the scenes about which others are drawn: studies, and models without a range of their own."""
    studies = [_of_study(read_yaml(study_path(name)).data) for name in study_names()]
    files = [
        Scene(dict(cf.load_model(path).defaults), "", (0.0, 0.0), str(path))
        for folder in folders
        for path in sorted(folder.glob("*.yaml"))
    ]
    return (*(scene for scene in studies if scene is not None), *files)


def _of_study(study: dict[str, Any]) -> Scene | None:
    """Return the scene of a study; None if it explores nothing, or explores ``coulomb``."""
    if study["model"] == "coulomb" or "explore" not in study:
        return None
    asked, begins = study["explore"], study["start"]
    params = cf.load_model(study["model"]).defaults | study.get("params", {})
    start = begins["simulate"] if isinstance(begins, dict) else {}
    low, high = asked["range"]
    return Scene(params, asked["parameter"], (low, high), study["model"], start)


def scene(seed: int, index: int, folders: tuple[Path, ...] = (MODELS,)) -> Scene:
    """Return a random scene about one of the bases."""
    rng = generator(seed, index)
    base = bases(folders)[int(rng.integers(len(bases(folders))))]
    model = cf.load_model(base.model)
    for _ in range(DRAWS):
        found = _moved(base, rng)
        try:
            for value in found.range:
                model.check_params(found.params | {found.vary: value})
            model.check_params(found.params)
        except cf.ParameterError:
            continue
        return found
    return base


def _moved(base: Scene, rng: np.random.Generator) -> Scene:
    moves = rng.uniform(-MOVED, MOVED, len(base.params))
    params = {
        name: float(value * (1.0 + move) if value else SMALL * move)
        for (name, value), move in zip(base.params.items(), moves, strict=True)
    }
    vary, (low, high) = base.vary, base.range
    if not vary:
        vary = str(rng.choice([name for name, value in params.items() if value != 0.0]))
        low, high = sorted((0.5 * params[vary], 1.5 * params[vary]))
    width = float(rng.uniform(*PART)) * (high - low)
    first = float(rng.uniform(low, high - width))
    params[vary] = first + float(rng.uniform(0.1, 0.9)) * width
    return replace(base, params=params, vary=vary, range=(first, first + width))


DRAWN = partial(scene, folders=(MODELS, TYPED))
RUN = Chunked(
    "models",
    WHAT,
    partial(chunk, draw=DRAWN, limit=LIMIT, most_periods=PERIODS),
    CHUNK,
    limit=LIMIT,
)

if __name__ == "__main__":
    RUN.command_line(count=60, seed=0)
