"""Studies: a YAML file that names what it wants, the plan that computes only that, the results.

Importing this package is cheap: YAML, pydantic and the engine are imported when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contfric.study.library import study_names, study_path
    from contfric.study.plan import Plan, make_plan
    from contfric.study.read import Study, read_study
    from contfric.study.result import StudyResult, UnwrittenError
    from contfric.study.run import run_study

_HOMES = {
    "Plan": "contfric.study.plan",
    "Study": "contfric.study.read",
    "StudyResult": "contfric.study.result",
    "UnwrittenError": "contfric.study.result",
    "make_plan": "contfric.study.plan",
    "read_study": "contfric.study.read",
    "run_study": "contfric.study.run",
    "study_names": "contfric.study.library",
    "study_path": "contfric.study.library",
}

__all__ = [
    "Plan",
    "Study",
    "StudyResult",
    "UnwrittenError",
    "make_plan",
    "read_study",
    "run_study",
    "study_names",
    "study_path",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
