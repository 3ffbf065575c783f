"""Studies by name: those that ship with contfric; any other by its path."""

from __future__ import annotations

import re
from pathlib import Path

from contfric.base.resources import bundled_dir
from contfric.errors import StudyError, did_you_mean, shown
from contfric.models.paths import SUFFIXES, is_path, no_file, not_a_file


def study_names() -> list[str]:
    """Return the names of the bundled studies, sorted.

    Examples
    --------
    >>> "fig05" in study_names()
    True
    """
    return sorted(path.stem for path in bundled_dir("studies").iterdir() if path.suffix in SUFFIXES)


def study_path(source: str | Path) -> Path:
    """Return the file of a study, by its path or its bundled name.

    Parameters
    ----------
    source : str or Path
        A text that ends in ``.yaml`` or ``.yml``, or has a folder in it, is a path.

    Raises
    ------
    StudyError
        If there is no such study.

    Examples
    --------
    >>> study_path("fig05").name
    'fig05.yaml'
    """
    given: object = source  # whatever the user gave
    if not isinstance(given, (str, Path)) or not str(given).strip() or "\0" in str(given):
        raise StudyError(f"a study is a path or the name of a bundled one, got {shown(given)}")
    if is_path(source):
        path = Path(source)
        if fault := no_file(path, "a study"):
            known = did_you_mean(path.stem, study_names()).partition("Valid")[2]
            bundled = "" if path.is_dir() else f". Bundled studies{known}"
            raise StudyError(f"{fault}{bundled}")
        return path
    text = str(source)
    for suffix in SUFFIXES:
        path = bundled_dir("studies") / f"{text}{suffix}"
        if path.is_file():
            return path
    names = study_names()
    # fig5 is fig05, and not fig15, which differs from it by one letter as well
    padded = re.sub(r"(?<!\d)\d$", lambda digit: f"0{digit.group()}", text)
    hint = did_you_mean(padded, names)
    raise StudyError(f"unknown study '{text}'{hint}. {not_a_file(text)}")
