"""The work of one call of a compiled kernel is limited, so that Ctrl-C acts between calls.

A kernel that may run for long takes a budget, and hands back what it needs to go on exactly where it was.
Nothing that is computed depends on where it was cut.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Time that one call may take (s): a person takes ten of them for at once.
_CALL = 0.1
#: Most that a budget grows by from one call to the next: one quick call is no rule.
_GROWTH = 4.0


@dataclass
class Pace:
    """The budget of the next call, from what the last ones took."""

    budget: int = 16

    def took(self, done: int, seconds: float) -> None:
        """Learn from a call that did so much of its budget in so many seconds.

        Examples
        --------
        >>> pace = Pace(100)
        >>> pace.took(100, 2.0)
        >>> pace.budget
        5
        """
        if done > 0:
            fits = min(done * _CALL / max(seconds, 1e-9), _GROWTH * self.budget)
            self.budget = max(1, int(fits))
