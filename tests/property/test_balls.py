"""Balls go to another process and back to the last bit; their precision belongs to one thread at a time."""

from __future__ import annotations

import pickle
import threading

from flint import acb, arb, ctx
from hypothesis import given
from hypothesis import strategies as st

from contfric.models.balls.numbers import working

MANTISSAS = st.integers(min_value=-(2**400), max_value=2**400)
RADII = st.one_of(
    st.integers(min_value=0, max_value=2**70),
    st.sampled_from([2**k + d for k in range(3, 60) for d in (-1, 0, 1)]),
)
EXPONENTS = st.integers(min_value=-(10**6), max_value=10**6)


@st.composite
def balls(draw: st.DrawFn) -> arb:
    return arb((draw(MANTISSAS), draw(EXPONENTS)), (draw(RADII), draw(EXPONENTS)))


def same(one: arb, other: arb) -> bool:
    return bool(one.mid() == other.mid() and one.rad() == other.rad())


@given(balls(), balls())
def test_pickled_to_the_last_bit(real: arb, imaginary: arb) -> None:
    assert same(pickle.loads(pickle.dumps(real)), real)
    disc = pickle.loads(pickle.dumps(acb(real, imaginary)))
    assert same(disc.real, real) and same(disc.imag, imaginary)


def test_what_is_not_finite() -> None:
    assert pickle.loads(pickle.dumps(arb("nan"))).is_nan()
    whole = pickle.loads(pickle.dumps(arb(3, "inf")))
    assert whole.contains(arb(10) ** 300) and whole.contains(-(arb(10) ** 300))


def test_threads_do_not_share_a_precision() -> None:
    found: list[tuple[int, int]] = []
    meet = threading.Barrier(8)

    def compute(bits: int) -> None:
        meet.wait()
        for _ in range(50):
            with working(bits):
                for _ in range(20):
                    found.append((bits, ctx.prec))
                    arb(2).sqrt()

    threads = [threading.Thread(target=compute, args=(53 + 40 * k,)) for k in range(8)]
    before = ctx.prec
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 * 50 * 20 and all(bits == prec for bits, prec in found)
    assert ctx.prec == before
