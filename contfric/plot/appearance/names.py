"""Names as mathematics: of parameters, surfaces and events, in labels and titles."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

_GREEK = frozenset(
    (
        *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda"),
        *("mu", "nu", "xi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega"),
        *("Gamma", "Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma", "Phi", "Psi", "Omega"),
    )
)

#: Most characters of a line of parameters: what stands above the narrowest figure of a study, 6.4 inches.
_LINE = 80


def parameter_label(name: str) -> str:
    r"""Return the name of a parameter as mathematics.

    Examples
    --------
    >>> parameter_label("S0"), parameter_label("Omega")
    ('$S_{0}$', '$\\Omega$')
    """
    found = re.fullmatch(r"([A-Za-z]+?)_?(\d*)|([A-Za-z])_([A-Za-z]\w*)", name)
    if found is None:
        return name
    word, index, letter, words = found.groups()
    if letter:  # the load u_brake
        below = words.replace("_", r"\,")
        return rf"${letter}_{{\mathrm{{{below}}}}}$"
    body = f"\\{word}" if word in _GREEK else word if len(word) == 1 else rf"\mathrm{{{word}}}"
    return f"${body}_{{{index}}}$" if index else f"${body}$"


def title_label(title: str, names: Sequence[str]) -> str:
    r"""Return a title with the names of parameters in it as mathematics.

    A name of one letter may be a word: it counts where a value or "in" stands next to it.

    Examples
    --------
    >>> title_label("A block in S at Omega = 0.5", ["A", "S", "Omega"])
    'A block in $S$ at $\\Omega$ = 0.5'
    """
    for name in sorted(names, key=len, reverse=True):
        word = rf"(?<![\w$\\{{]){re.escape(name)}(?![\w}}])"
        if len(name) == 1:
            word = rf"(?:{word}(?=\s*=)|(?<=\bin ){word}|(?<=\band ){word})"
        title = re.sub(word, parameter_label(name).replace("\\", r"\\"), title)
    return title


def full_title(title: str, names: Sequence[str], fixed: Mapping[str, float]) -> str:
    r"""Return a title with symbols, and below it the fixed parameters that it does not name.

    Examples
    --------
    >>> full_title("S at Omega = 0.5", ["S", "Omega", "h"], {"Omega": 0.5, "h": 0.1})
    'S at $\\Omega$ = 0.5\n$h$ = 0.1'
    """
    missing = {
        name: value
        for name, value in fixed.items()
        if not re.search(rf"(?<!\w){name}\s*=\s*{value:.6g}(?!\d)", title)
    }
    lines = [title_label(title, names), fixed_text(missing)]
    return "\n".join(filter(None, lines))


def parameters_to_show(
    fixed: Mapping[str, float], defaults: Mapping[str, float]
) -> dict[str, float]:
    """Return the parameters to name in a title: all but those that are 0 and are 0 by default (unused terms).

    Examples
    --------
    >>> parameters_to_show({"S": 0.32, "zeta": 0.0, "h": 0.0}, {"S": 0.32, "zeta": 0.1, "h": 0.0})
    {'S': 0.32, 'zeta': 0.0}
    """
    return {n: v for n, v in fixed.items() if v != 0.0 or defaults.get(n, 0.0) != 0.0}


def fixed_text(fixed: Mapping[str, float]) -> str:
    r"""Return parameters and their values as a title, in lines that fit.

    Examples
    --------
    >>> fixed_text({"S": 0.32, "S0": 0.4})
    '$S$ = 0.32, $S_{0}$ = 0.4'
    >>> fixed_text({f"number{k}": k for k in range(1, 12)}).count("\n")
    2
    """
    lines = [""]
    for part in (f"{parameter_label(n)} = {v:.6g}" for n, v in fixed.items()):
        longer = f"{lines[-1]}, {part}" if lines[-1] else part
        if len(re.sub(r"[${}\\]", "", longer)) <= _LINE:
            lines[-1] = longer
        else:
            lines.append(part)
    return ",\n".join(lines)


def surface_label(name: str) -> str:
    """Return the name of a surface as mathematics.

    Examples
    --------
    >>> surface_label("F+")
    '$F^{+}$'
    """
    found = re.fullmatch(r"([A-Za-z]+)([+-]?)", name)
    if found is None:
        return name
    word, sign = found.groups()
    return f"${word}^{{{sign}}}$" if sign else f"${word}$"


def event_label(label: str) -> str:
    r"""Return the label of an event as mathematics.

    Examples
    --------
    >>> event_label("SN_1a")
    '$\\mathrm{SN}_{1a}$'
    >>> event_label("T")
    '$\\mathrm{T}$'
    """
    kind, _, index = label.partition("_")
    if not index:
        return rf"$\mathrm{{{kind}}}$"
    index = re.sub(r"[A-Za-z]{2,}", lambda m: rf"\mathrm{{{m.group()}}}", index)
    index = index.replace(", ", r",\,").replace(" ", r"\ ")
    return rf"$\mathrm{{{kind}}}_{{{index}}}$"
