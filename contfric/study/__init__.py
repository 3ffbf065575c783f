"""Studies: a YAML file that names the wanted results, the plan that computes only these, and their files.

Importing this package is cheap: YAML, pydantic and the engine are imported when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.lazy import lazily

if TYPE_CHECKING:
    from contfric.study.library import study_names as study_names
    from contfric.study.library import study_path as study_path
    from contfric.study.plan import Plan as Plan
    from contfric.study.plan import make_plan as make_plan
    from contfric.study.read import Study as Study
    from contfric.study.read import read_study as read_study
    from contfric.study.result import StudyResult as StudyResult
    from contfric.study.result import UnwrittenError as UnwrittenError
    from contfric.study.run import run_study as run_study

__all__, __getattr__, __dir__ = lazily(__name__)
