"""Words of an orbit and of its half, and the labels of its segments."""

from __future__ import annotations

from contfric.errors import NotationError
from contfric.models.definition import Model
from contfric.orbit.system import Word, exit_domains, mirror_mode


def mirror_pairs(model: Model, word: Word) -> Word:
    """Return the mirror image of a word, segment by segment (not rotated)."""
    assert model.symmetry is not None
    surfaces = model.symmetry.surfaces
    return tuple((mirror_mode(model)[mode], surfaces[exit_]) for mode, exit_ in word)


def half_of(model: Model, word: Word, periods: int) -> Word | None:
    """Return the first half if the second one is its mirror image, else None.

    An orbit of an even number of periods has no such half: twice the symmetry is one period.
    """
    if model.symmetry is None or len(word) % 2 or periods % 2 == 0:
        return None
    half = word[: len(word) // 2]
    return half if mirror_pairs(model, half) == word[len(word) // 2 :] else None


def whole_of(model: Model, word: Word, half: bool) -> Word:
    """Return the word of the whole orbit."""
    return word + mirror_pairs(model, word) if half else word


def passed_domains(
    model: Model, mode: str, end_signs: dict[str, int], exit_: str, after: str, crossed: list[str]
) -> list[str]:
    """Return the domains of one segment in order, from the surfaces that it crosses.

    They are found backwards from the domain in which it ends: the one whose signs agree with the
    state there, among those from which its exit leads on.
    """
    candidates = exit_domains(model, mode, exit_, after)
    fitting = [d for d in candidates if _agrees(model, d, end_signs, exit_)]
    if not fitting and not candidates:
        raise NotationError(f"no domain of {mode} leads through {exit_} into {after}")
    domain = (fitting or candidates)[0]
    domains = [domain]
    for surface in reversed(crossed):
        domain = _across(model, domain, surface)
        domains.append(domain)
    return domains[::-1]


def _agrees(model: Model, domain: str, signs: dict[str, int], skipped: str) -> bool:
    own = model.domain_by_name[domain].signs
    return all(own[s] * signs[s] >= 0 for s in own if s != skipped)


def _across(model: Model, domain: str, surface: str) -> str:
    """Return the domain on the other side of a transparent surface."""
    for (source, through), target in model.transitions.items():
        if target == domain and through == surface:
            same = model.domain_by_name[source].mode == model.domain_by_name[domain].mode
            if same:
                return source
    return domain


def decode(code: int, surfaces: list[str]) -> list[str]:
    """Return the surfaces crossed, in order, from the digits of a label."""
    base = len(surfaces) + 1
    crossed: list[str] = []
    while code > 0:
        code, digit = divmod(code, base)
        crossed.append(surfaces[digit - 1])
    return crossed[::-1]
