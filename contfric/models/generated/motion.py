"""The end of a generated module: the functions of a model, bundled to its flow."""

from __future__ import annotations

from collections.abc import Sequence

from contfric.models.described.description import Description
from contfric.models.generated.code import Lines

#: The functions that are kernels: where a model has kinks, three of them are helpers of these.
_WITHOUT_KINKS = """
observe, rate, field_of = observe_at, rate_at, field
"""

_WITH_KINKS = """
@kernel(observe_signature)
def observe(c, t, y, p, which, grad):
    return observe_at(c, t, y, p, which, grad)


@kernel(rate_signature)
def rate_of_piece(mode, c, t, y, p, which, grad):
    return rate_at(mode, c, t, y, p, which, grad)


@kernel(field_signature)
def field_of_piece(mode, t, y, p, which, out, jac):
    field(mode, t, y, p, which, out, jac)


@kernel(rate_signature)
def rate(mode, c, t, y, p, which, grad):
    return rate_at(piece_of(mode, t, y, p), c, t, y, p, which, grad)


@kernel(field_signature)
def field_of(mode, t, y, p, which, out, jac):
    field(piece_of(mode, t, y, p), t, y, p, which, out, jac)

"""

_AFFINE = """
AFFINE = AffineModes(
    {{
        "entries": entries,
        "entries_seen": entries_seen,
        "frequencies": frequencies,
        "audible": audible,
        "audible_seen": audible_seen,
        "rates": rates,
        "expand": expand,
        "vary": vary,
        "sums": sums,
        "look": look,
    }},
    entries=ENTRIES,
    waves=WAVES,
    closed={closed},
    seen={seen},
)
"""

_FLOW = '''
def functions(tolerance):
    """Return what solutions are found from."""
    return Functions(
        field={field},
        observe=observe,
        rate={rate},
        period=period,
        scale=scale_of,
        modes={modes},
        observables={observables},
        method={method!r},
        relative=tolerance,
        absolute=tolerance,
        kinks={kinks},
        slides={slides},
        onto=onto,
        idle={idle},
        timed={timed},
        affine={affine},
    )


def compiled_flow(tolerance):
    """Return the compiled functions of this model, with the error that a step may make."""
    return functions(tolerance).flow(level, rate=rate{reset})
'''


def piece_code(kinks: list[int]) -> str:
    """Return the helper that tells the pieces of a mode apart (:mod:`contfric.flow.integration.kinked`).

    Parameters
    ----------
    kinks : the observables that vanish at the kinks
    """
    code = Lines()
    code.add("", "", "@helper(i8(i8, f8, vector, vector))")
    code.open("def piece_of(mode, t, y, p):")
    code.add(f"piece = mode * {1 << len(kinks)}")
    for k, c in enumerate(kinks):
        code.add(
            f"if observe_at({c}, t, y, p, NO_INDICES, NO_NUMBERS) > 0.0:", f"    piece += {1 << k}"
        )
    code.add("return piece")
    code.close()
    return str(code)


def motion_code(
    description: Description,
    idle: Sequence[tuple[int, int]],
    timed: Sequence[int],
    closed: Sequence[int],
    seen: Sequence[int],
) -> str:
    """Return the end of the module of a model.

    Parameters
    ----------
    idle : pairs (mode, observable) for which the observable never changes along the mode
    timed : observables of time alone: their zeros need no integration
    closed : pieces of modes that are affine
    seen : observables that are
    """
    observables = [o.name for o in description.observables]
    kinks = [observables.index(name) for name in description.kinks]
    code = piece_code(kinks) + _WITH_KINKS if kinks else _WITHOUT_KINKS
    if closed:
        code += _AFFINE.format(closed=list(closed), seen=list(seen))
    return code + _FLOW.format(
        field="field_of_piece" if kinks else "field",
        rate="rate_of_piece" if kinks else "rate",
        modes=len(description.modes),
        observables=len(observables),
        method=description.method,
        kinks=kinks,
        slides=[m for m, mode in enumerate(description.modes) if 0 in mode.sides.values()],
        idle=list(idle),
        timed=list(timed),
        affine="AFFINE" if closed else None,
        reset=", reset=reset" if description.resets else "",
    )
