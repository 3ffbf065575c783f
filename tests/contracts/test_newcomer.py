"""What somebody who is new here may give: one line that says what, and what is valid; no other error."""

from __future__ import annotations

import itertools
import sys

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.plane.sections import sections_of
from contfric.base.extras import MissingPackageError
from contfric.curves.ranges import box_of

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
RANGES = {"Omega": (0.5, 0.6), "S": (0.3, 0.34)}


#: Things that are no number, no name, no list of what is wanted.
ODD = [
    *(None, "x", "0.5", -1, 1.5, True, float("nan"), [], {}, [1, 2], ("a", "b")),
    *(np.array([0.6, 0.4]), np.array(0.5), object(), 10**400, b"x", lambda: 1, 1 + 1j, " "),
    *({"Omega": "0.5"}, {"Omega": None}, {"omega": 0.5}, {"Omega": np.array([0.5, 0.6])}, {1: 2}),
    *({"Omega": (0.5, 0.6), "S": (0.3, 0.34)}, ("Omega", "S")),
]

DATA = [cf.Measured("x_max", 1.42, 0.01, {"Omega": 0.5})]

#: Arguments of calls that end at once, whatever is given for them.
CALLS = {
    "model": lambda o, d, x: cf.find_orbit(x, PARAMS),
    "params": lambda o, d, x: cf.simulate("coulomb", x, periods=1),
    "state": lambda o, d, x: cf.simulate("coulomb", PARAMS, state=x, periods=1),
    "time": lambda o, d, x: cf.simulate("coulomb", PARAMS, time=x, periods=1),
    "domain": lambda o, d, x: cf.simulate("coulomb", PARAMS, domain=x, periods=1),
    "periods": lambda o, d, x: cf.find_orbit("coulomb", PARAMS, periods=x),
    "seed": lambda o, d, x: cf.solve_orbit("coulomb", "1a", PARAMS, seed=x),
    "orbit": lambda o, d, x: cf.explore(x, "Omega", (0.49, 0.51)),
    "parameter": lambda o, d, x: cf.continue_orbit(o, x, (0.49, 0.51)),
    "stability": lambda o, d, x: cf.continue_orbit(o, "Omega", (0.499, 0.501), stability=x),
    "max_points": lambda o, d, x: cf.continue_orbit(o, "Omega", (0.499, 0.501), max_points=x),
    "bridges": lambda o, d, x: cf.explore(o, "Omega", (0.499, 0.501), bridges=x),
    "seeds": lambda o, d, x: cf.explore(o, "Omega", (0.499, 0.501), seeds=x),
    "values": lambda o, d, x: cf.Seeds(values=x),
    "pair": lambda o, d, x: cf.continue_bifurcation(d.bifurcations[0], x, RANGES),
    "ranges": lambda o, d, x: cf.continue_bifurcation(d.bifurcations[0], ("Omega", "S"), x),
    "swapped": lambda o, d, x: cf.explore_plane(o, x, ("Omega", "S")),
    "held": lambda o, d, x: cf.continue_quantity(o, "x_max", 1.4, x, ("Omega", "S")),
    "swept": lambda o, d, x: cf.sweep("coulomb", x, "Omega"),
    "fit": lambda o, d, x: cf.fit("coulomb", DATA, x, "S"),
    "sections": lambda o, d, x: sections_of(o, box_of(o.model, ("Omega", "S"), RANGES), x),
    "section": lambda o, d, x: sections_of(o, box_of(o.model, ("Omega", "S"), RANGES), {"S": x}),
    "kinds": lambda o, d, x: cf.explore_plane(o, ("Omega", "S"), RANGES, kinds=x, max_step=2.0),
    "census": lambda o, d, x: cf.census("coulomb", {**PARAMS, "S": x}, periods=0),
    "axes": lambda o, d, x: cf.lyapunov_map("coulomb", x),
    "axis": lambda o, d, x: cf.lyapunov_map("coulomb", {"Omega": x, "S": [0.3]}, tile=0),
    "load": lambda o, d, x: cf.load(x),
    "save": lambda o, d, x: cf.save(x, "nowhere/x.npz"),
    "load_signature": lambda o, d, x: cf.load_signature(x),
    "segments": lambda o, d, x: cf.Signature(o.model, x),
    "Signature": lambda o, d, x: cf.Signature(x, ("x0v+", "x0v0", "x-v+"), periods=0),
    "graph": lambda o, d, x: cf.transition_graph(x),
    "names": lambda o, d, x: cf.signature_names(x),
    "study": lambda o, d, x: cf.run_study(x),
    "of_kind": lambda o, d, x: d.of_kind(x),
    "bridge": lambda o, d, x: cf.period_adding(x),
    "points": lambda o, d, x: o.to_dataframe(x),
    "row": lambda o, d, x: d.plot(row=x),
    "index_of": lambda o, d, x: o.model.index_of(x),
}


@pytest.mark.parametrize("name", CALLS)
def test_every_odd_argument_is_told_in_one_line(orbit, diagram, name) -> None:
    refused = 0
    for odd in ODD:
        try:
            CALLS[name](orbit, diagram, odd)
        except cf.ContfricError as error:
            assert len(str(error).splitlines()) == 1
            assert str(error).strip()
            refused += 1
    assert refused >= len(ODD) // 2, "most of them are valid nowhere"


@pytest.mark.parametrize(
    ("name", "odd", "message"),
    [
        ("of_kind", "XX", "no kind of bifurcation 'XX'.*Valid: SN, BP, PD, NS, CS, SS, AS, GS, T"),
        ("of_kind", "sn", "'sn'.*did you mean 'SN'"),
        ("of_kind", "LP", "'LP'; did you mean 'SN'"),
        ("of_kind", "TR", "'TR'; did you mean 'NS'"),
        ("row", "amplitude", r"no row 'amplitude' in a diagram\. Valid: x_max"),
        ("swapped", RANGES, r"ranges is a mapping, such as \{'Omega'.*got \('Omega', 'S'\)"),
        ("held", RANGES, "ranges is a mapping"),
        ("swept", np.array([0.4, 0.5]), "no parameter .*Valid: Omega"),
        ("segments", 3, "names of domains, as a list or joined by '->', got 3"),
        ("Signature", None, "needs a model, or the name of one, got None"),
        ("time", "0.5", "time is a finite number, got '0.5'"),
        ("seeds", 3, r"Seeds\(values=20, states=3\), or None; got 3"),
        ("kinds", "SN", r"kinds is a list, such as \['SN', 'BP'\], got 'SN'"),
        ("params", 3, "params is a mapping, such as {'Omega'"),
        ("parameter", "omega", "no parameter 'omega'; did you mean 'Omega'"),
        ("stability", "yes", "stability is True or False, got 'yes'"),
        ("load", None, "is a path, such as 'results.npz', got None"),
        ("row", "xmax", "no row 'xmax' in a diagram; did you mean 'x_max'"),
    ],
)
def test_the_line_says_what_is_valid(orbit, diagram, name, odd, message) -> None:
    with pytest.raises(cf.ContfricError, match=message):
        CALLS[name](orbit, diagram, odd)


def test_a_function_that_is_none_is_refused_before_anything_is_computed(orbit) -> None:
    for call in (cf.continue_orbit, cf.explore):
        with pytest.raises(cf.ParameterError, match="progress is a function of one text"):
            call(orbit, "Omega", (0.49, 0.51), progress="print")


def test_numbers_of_numpy_are_numbers(orbit) -> None:
    one, half = np.int64(1), np.float64(0.5)
    assert cf.find_orbit("coulomb", {"Omega": half}, periods=one, time=half).periods == 1
    branch = cf.continue_orbit(
        orbit, "Omega", np.array([0.49, 0.51]), max_points=np.int32(30), stability=np.bool_(True)
    )
    assert len(branch) > 2


def test_a_signature_as_it_is_printed(orbit) -> None:
    signature = orbit.signature
    printed = str(signature)
    model = orbit.model
    for given in itertools.permutations((printed, "coulomb")):
        assert cf.Signature(*given) == signature
    for given in itertools.permutations((list(signature.segments), model)):
        assert cf.Signature(*given) == signature
    assert eval(repr(signature), {"Signature": cf.Signature}) == signature


def test_a_slice_of_a_branch_is_a_list_of_orbits(diagram) -> None:
    branch = diagram.branches[0]
    every = list(branch)
    for part in (slice(0, 3), slice(None, None, -7), slice(-2, None), slice(5, 5)):
        found = branch[part]
        assert isinstance(found, list)
        assert [o.params for o in found] == [o.params for o in every[part]]
        assert all(isinstance(o, cf.Orbit) for o in found)


def test_a_slice_of_a_curve(diagram) -> None:
    fold = diagram.of_kind("SN")[0]
    curve = cf.continue_bifurcation(
        fold, ("Omega", "S"), {"Omega": (0.53, 0.55), "S": (0.31, 0.33)}, max_points=4
    )
    assert [o.params for o in curve[1:3]] == [curve[1].params, curve[2].params]


@pytest.mark.parametrize("of", ["orbit", "branch", "diagram", "census", "plane"])
def test_without_pandas_the_message_says_how_to_get_it(orbit, diagram, monkeypatch, of) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    found = {"orbit": orbit, "branch": diagram.branches[0], "diagram": diagram}
    if of == "census":
        found[of] = cf.census("coulomb", {"Omega": 0.55}, stops=1)
    if of == "plane":
        found[of] = cf.Plane.__new__(cf.Plane)
        object.__setattr__(found[of], "curves", ())
    with pytest.raises(MissingPackageError, match=r"pip install 'contfric\[pandas\]'") as caught:
        found[of].to_dataframe()
    assert isinstance(caught.value, (cf.ContfricError, ImportError))
