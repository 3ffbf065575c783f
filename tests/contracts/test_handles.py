"""Blocks of memory by their addresses: what is after a handle, and kernels that are bound to one."""

from __future__ import annotations

import os
import sys
from importlib.util import cache_from_source
from pathlib import Path

import numpy as np
import pytest
from numba import types

from contfric.base.sources import package_files
from contfric.cli import main
from contfric.cli.doctor import stale_bytecode, write_bytecode
from contfric.compiled import blocks, f8, helper, i8, indices, kernel, vector
from contfric.flow.integrated import AffineModes, Functions
from contfric.handle import ITSELF, TABLE, Block, Bound, HandleType, with_handle
from contfric.models import load_model
from contfric.models.generated import build
from contfric.shipping.ahead import every_kernel, missing

LAYOUT = {"scaled": f8(f8), "table": TABLE, "count": i8, "factor": f8, "other": ITSELF}


@helper
def shifted(x):
    return x + 0.5


HANDLE = HandleType("of the tests", LAYOUT, {"shift": shifted, "twice": 2})


@kernel(f8(f8))
def thrice(x):
    return 3.0 * x


@kernel(f8(f8))
def halved(x):
    return 0.5 * x


@kernel(with_handle(f8(f8, vector), HANDLE))
def total(motion, x, out):
    for k in range(motion.count):
        out[k] = motion.table[k] + motion.other.factor
    return motion.twice * motion.shift(motion.factor * motion.scaled(x)) + motion.other.scaled(x)


SHAPES = f8(i8, types.complex128[:, ::1], blocks, indices, types.boolean)
SHAPED = HandleType("of the tests with arrays", {"shaped": SHAPES})


@kernel(SHAPES)
def shaped(k, grid, cube, which, flag):
    found = 0.0
    for i in range(grid.shape[0]):
        for j in range(grid.shape[1]):
            found += (i + 2 * j + k) * (grid[i, j].real - 3.0 * grid[i, j].imag)
    part = cube[1]
    for i in range(part.shape[0]):
        for j in range(part.shape[1]):
            found += part[i, j] * (i - j) if flag else part[i, j]
    cube[0, :, :] = found
    return found + which.sum() + cube.size


@kernel(with_handle(SHAPES, SHAPED))
def called(motion, k, grid, cube, which, flag):
    return motion.shaped(k, grid[1:], cube, which[1:3], flag)


@pytest.mark.parametrize("flag", [True, False])
def test_arrays_of_all_kinds_reach_a_function_behind_an_address(flag):
    """Their data and shapes are handed over; a contiguous part of an array is an array of its own."""
    rng = np.random.default_rng(3)
    grid = rng.normal(size=(4, 3)) + 1j * rng.normal(size=(4, 3))
    cube, which = rng.normal(size=(2, 3, 5)), np.arange(5)
    other = cube.copy()
    behind = Block(SHAPED.layout, {"shaped": shaped})
    expected = shaped(7, grid[1:].copy(), other, which[1:3].copy(), flag)
    assert called(behind.address, 7, grid, cube, which, flag) == expected
    assert np.array_equal(cube, other)
    i, j = np.indices((3, 3))
    own = np.sum((i + 2 * j + 7) * (grid[1:].real - 3.0 * grid[1:].imag))
    i, j = np.indices((3, 5))
    own += np.sum(cube[1] * (i - j if flag else 1.0))
    assert expected == pytest.approx(own + 3 + 30, abs=1e-12)


def block(function, factor, table, other=None):
    values = {"scaled": function, "table": table, "count": len(table), "factor": factor}
    return Block(LAYOUT, values if other is None else {**values, "other": other})


@pytest.mark.parametrize("seed", range(5))
def test_members_are_what_the_block_holds(seed):
    rng = np.random.default_rng(seed)
    a, b, x = rng.normal(size=3)
    table = rng.integers(-(2**40), 2**40, 4).tolist()
    inner = block(halved, b, [7])
    outer = block(thrice, a, table, inner)
    bound, out = Bound(total, outer), np.empty(4)
    expected = 2 * (a * (3.0 * x) + 0.5) + 0.5 * x
    assert total(outer.address, x, out) == expected
    assert bound(x, out) == expected
    assert out.tolist() == [t + b for t in table]


def test_a_bound_kernel_is_a_function_of_a_block():
    """Compiled code calls it like any other: two blocks, one kernel, and neither knows of the other."""
    layout = {"one": f8(f8, vector), "two": f8(f8, vector)}
    handle = HandleType("of bound kernels", layout)

    def difference(pair, x, out):
        return pair.one(x, out) - pair.two(x, out)

    first, second = (block(thrice, f, [1], block(halved, 0.0, [])) for f in (2.0, 5.0))
    pair = Block(layout, {"one": Bound(total, first), "two": Bound(total, second)})
    compiled = kernel(with_handle(f8(f8, vector), handle))(difference)
    out = np.empty(1)
    x = 1.25
    assert compiled(pair.address, x, out) == pytest.approx(2 * 3 * x * (2.0 - 5.0), rel=1e-15)


def test_a_member_that_a_block_does_not_have_is_an_error_of_the_compiler():
    def wrong(motion, x):
        return motion.scale(x)

    with pytest.raises(Exception, match="Unknown attribute 'scale'"):
        kernel(with_handle(f8(f8), HANDLE))(wrong).dispatcher  # noqa: B018


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"slides": (0,)}, "'onto' has to put a state"),
        ({"affine": AffineModes({}, 0, 0, (0,), ()), "method": "automatic"}, "explicit method"),
        ({"method": "quick"}, "'quick' is not a valid Method"),
    ],
)
def test_functions_that_do_not_fit_are_refused(wrong, message):
    """Compiled code would call what is not there."""
    names = ("field", "observe", "rate", "period", "scale")
    with pytest.raises(ValueError, match=message):
        Functions(**dict.fromkeys(names, thrice), modes=1, observables=1, **wrong)


def test_a_module_is_generated_again_by_another_generator(monkeypatch, tmp_path):
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path))
    definition = load_model("belt").definition
    before = build.module_path.__wrapped__(definition)
    assert build.module_path.__wrapped__(definition) == before
    monkeypatch.setattr(build, "_generator", lambda: "another one")
    assert build.module_path.__wrapped__(definition) == before  # it wrote the same code
    monkeypatch.setattr(build, "_generator", lambda: "one that writes other code")
    monkeypatch.setattr(build, "_generated", lambda *arguments: "code = 2\n")
    assert build.module_path.__wrapped__(definition) != before


def test_doctor_says_what_is_compiled(capsys, tmp_path, monkeypatch):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out
    count = len(every_kernel())
    assert f"{count - len(missing())} of {count} compiled" in lines
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path))
    assert main(["doctor"]) == 0
    assert f"0 of {count} compiled" in (out := capsys.readouterr().out)
    assert "contfric doctor --compile" in out


def test_doctor_writes_bytecode_where_it_is_missing_or_old(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))  # a place without any
    stale, count = stale_bytecode()
    assert len(stale) == count > 300
    own = package_files()
    package = [file for file in stale if file in own][:20]
    assert len(package) == 20
    write_bytecode(package)
    left, again = stale_bytecode()
    assert again == count and len(left) == count - len(package)
    assert not set(left) & set(package)
    kept = Path(cache_from_source(str(package[0])))
    os.utime(kept, (0, 0))
    assert package[0] in stale_bytecode()[0]


def test_every_kernel_of_the_package_is_known():
    names = set(every_kernel())
    assert {"contfric.continuation.core.march.march", "contfric.flow.general.hit-stiff"} <= names
    assert not any(name.startswith("contfric_model") for name in names)
