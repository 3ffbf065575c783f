"""Matplotlib in a process that draws and ends, which nobody asks for documentation."""

from __future__ import annotations

import sys

from contfric.base.interrupts import held_back


def load_undocumented() -> None:
    """Load matplotlib without writing the docstrings and signatures of ``set`` of its hundred artists.

    They are made when a class is, from the docstrings of all its other methods: a third of the time of
    loading. Nothing changes where it is loaded already, or where it makes them in another way.
    """
    if "matplotlib.artist" in sys.modules:
        return
    with held_back():
        from matplotlib.artist import Artist

        name = "_update_set_signature_and_docstring"
        described = vars(Artist).get(name)
        if described is not None:
            setattr(Artist, name, classmethod(lambda kind: None))
        try:
            import matplotlib.backends.backend_agg
            import matplotlib.figure  # noqa: F401
        finally:
            if described is not None:
                setattr(Artist, name, described)
