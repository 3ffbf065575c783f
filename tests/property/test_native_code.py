"""Machine code of formulas against Python itself, which runs the same text."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import contfric as cf
from contfric.base.checked import write_sealed
from contfric.compiled import f8, i8, matrix, types, vector
from contfric.models.generated.build import GeneratedFlow, coded_flow, load_module
from contfric.models.generated.unit import Formula, GeneratedUnit

MODELS = Path(__file__).parents[1] / "models"
#: Numbers of each kind that no function of a model has more of.
LONG = 80

TEXT = """
import math

def of_one(k, x):
    if k == 0:
        return math.sin(x)
    elif k == 1:
        return math.cos(x)
    elif k == 2:
        return math.tan(x)
    elif k == 3:
        return math.asin(math.tanh(x))
    elif k == 4:
        return math.acos(math.tanh(x))
    elif k == 5:
        return math.atan(x)
    elif k == 6:
        return math.sinh(math.sin(x))
    elif k == 7:
        return math.cosh(math.sin(x))
    elif k == 8:
        return math.exp(-x * x)
    elif k == 9:
        return math.log(1.0 + abs(x))
    elif k == 10:
        return math.sqrt(abs(x)) ** 3
    elif k == 11:
        return (1.5 + math.sin(x)) ** 0.3
    elif k == 12:
        return 1.0 / (2.5 + math.floor(x)) if -1.5 < x < 3.0 or x == 7.0 else -math.pi
    return inner(x, k) ** 7


def inner(x, k):
    return x - k if x > k else (x + 2 * k if x != 0.25 else -x)


def loops(n, a, b, out):
    total = 0.0
    p, q = 1.0, 2.0
    for k in range(n):
        p, q = q, p
        total += TABLE[k + 1] * a[k] * p
        out[k, 1] = total
        if b[k] < 0.0:
            pass
        else:
            out[k][0] += b[k]
    for j in range(out.shape[0]):
        out[j, 2] = -out[j, 1] / q
    return total
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The functions of the text, and those that Python makes of it."""
    file = tmp_path_factory.mktemp("unit") / "functions_to_test.py"
    write_sealed(file, TEXT)
    names = {"TABLE": np.arange(1.0, 9.0)}
    exec(compile(TEXT, str(file), "exec"), names)
    unit = GeneratedUnit("functions_to_test", str(file))
    unit.tables["TABLE"] = names["TABLE"]
    unit.helper(f8(f8, i8))(names["inner"])
    kernels = {
        "of_one": unit.kernel(f8(i8, f8))(names["of_one"]),
        "loops": unit.kernel(f8(i8, vector, vector, matrix))(names["loops"]),
    }
    return kernels, names


@given(st.integers(0, 14), st.floats(-9.0, 9.0) | st.just(0.25))
def test_arithmetic_is_that_of_python(written, k, x):
    kernels, names = written
    assert kernels["of_one"](k, x) == pytest.approx(names["of_one"](k, x), rel=2e-15, abs=2e-15)


@given(st.integers(0, 7), st.integers(0, 2**32 - 1))
def test_loops_and_arrays(written, n, seed):
    kernels, names = written
    rng = np.random.default_rng(seed)
    a, b, out = rng.normal(size=8), rng.normal(size=8), rng.normal(size=(7, 3))
    other = out.copy()
    assert kernels["loops"](n, a, b, out) == names["loops"](n, a, b, other)
    assert np.array_equal(out, other)


def test_what_is_no_number_and_what_is_infinite(tmp_path):
    text = "import math\n\ndef f(k, x):\n    if k == 0:\n        return 1.0 / x\n"
    text += "    return math.sqrt(x) if k == 1 else math.log(x)\n"
    write_sealed(tmp_path / "beyond.py", text)
    names = {}
    exec(text, names)
    f = GeneratedUnit("beyond", str(tmp_path / "beyond.py")).kernel(f8(i8, f8))(names["f"])
    assert (f(0, 0.0), f(0, -0.0), f(2, 0.0)) == (math.inf, -math.inf, -math.inf)
    assert math.isnan(f(1, -1.0))
    assert math.isnan(f(2, -1.0))


def modules():
    """Generated modules of the models of the tests, and some bundled ones."""
    for name in [
        "coulomb-yaml",
        "popp",
        "pendulum",
        "beam-stop",
        "lugre",
        *sorted(MODELS.glob("*.yaml")),
    ]:
        flow = cf.load_model(name).flow_factory
        if isinstance(flow, GeneratedFlow) and coded_flow(flow.definition) is None:
            yield str(name), load_module(flow.definition)


def arguments_of(rng, signature, largest):
    """Random arguments: whole numbers below a limit, arrays with room for all that is written."""
    found = []
    for kind in signature.args:
        if kind == i8:
            found.append(int(rng.integers(0, largest)))
        elif kind == f8:
            found.append(float(rng.uniform(0.1, 2.0)))
        elif kind.dtype == types.int64:
            found.append(np.arange(5))
        else:
            found.append(rng.uniform(0.1, 2.0, (LONG,) * kind.ndim))
    return found


def test_functions_of_models_are_what_python_makes_of_them(monkeypatch):
    tried = 0
    rng = np.random.default_rng(3)
    for name, module in modules():
        monkeypatch.setattr(module, "NO_INDICES", np.empty(0, dtype=np.int64), raising=False)
        monkeypatch.setattr(module, "NO_NUMBERS", np.empty(0), raising=False)
        formulas = {k: f for k, f in vars(module).items() if isinstance(f, Formula)}
        for key, formula in formulas.items():
            monkeypatch.setitem(vars(module), key, formula.__wrapped__)
        for key, formula in formulas.items():
            for _ in range(3):
                given_ = arguments_of(rng, formula.signature, 3)
                other = [a.copy() if isinstance(a, np.ndarray) else a for a in given_]
                try:
                    wanted = formula.__wrapped__(*other)
                except (ValueError, ArithmeticError):
                    continue  # Python has no number for it
                value = formula(*given_)
                assert (value is None) == (wanted is None)
                if value is not None:
                    assert value == pytest.approx(wanted, rel=1e-14, abs=1e-14), (name, key)
                for a, b in zip(given_, other, strict=True):
                    np.testing.assert_allclose(
                        a, b, rtol=1e-13, atol=1e-13, err_msg=f"{name} {key}"
                    )
                tried += 1
        monkeypatch.undo()
    assert tried > 300
    assert "contfric.models.generated.native" in sys.modules
