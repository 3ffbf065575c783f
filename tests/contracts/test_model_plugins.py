"""Models of other packages, of classes and of files: found, pickled, saved, used in studies."""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.cli import main
from contfric.models import functions
from contfric.models.functions import where
from contfric.results.archive import _digests

YAML = """\
name: {name}
states: [x, v]
parameters: {{Omega: 0.7, S: 0.2, zeta: 0.05}}
constraints: [Omega > 0]
period: 2*pi/Omega
observables: {{u: x - cos(Omega*t)}}
surfaces:
  F+: {{observable: u, level: S}}
  F-: {{observable: u, level: -S}}
  v: {{observable: v, level: 0}}
field: {{x: v, v: -u - 2*zeta*v - S*sign(v)}}
modes:
  forward: {{in: {{v: +}}}}
  backward: {{in: {{v: -}}}}
  stick: {{in: {{v: 0, F+: -, F-: +}}, field: {{x: 0, v: 0}}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""

PACKAGE = '''\
"""A package that offers models and signatures."""

from pathlib import Path

import contfric as cf

folder = Path(__file__).parent / "models"
signatures = Path(__file__).parent / "signatures"


class Pendulum(cf.OscillatorModel):
    """A block on a belt."""

    name = "class-of-plugin"
    states = ("x", "v")
    parameters = {"vb": 0.4, "F": (1.0, "friction")}
    surfaces = {"belt": ("v", "vb"), "stop": ("v", 0), "F+": ("x", "F"), "F-": ("x", "-F")}
    modes = {
        "ahead": {"belt": 1},
        "rise": {"belt": -1, "stop": 1},
        "fall": {"stop": -1},
        "stick": {"belt": 0, "F+": -1, "F-": 1},
    }

    def field(self, mode, t, y, p):
        if mode == "stick":
            return p.vb, 0
        friction = p.F / (1 + abs(y.v - p.vb))
        return y.v, -y.x - (friction if mode == "ahead" else -friction)


def broken():
    raise RuntimeError("no licence")
'''

ENTRY_POINTS = """\
[contfric.models]
class-of-plugin = plugin:Pendulum
models-of-plugin = plugin:folder
broken-of-plugin = plugin:broken

[contfric.signatures]
signatures-of-plugin = plugin:signatures
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with an installed package: its modules and its metadata."""
    site = tmp_path_factory.mktemp("site")
    (site / "plugin" / "models").mkdir(parents=True)
    (site / "plugin" / "signatures").mkdir()
    (site / "plugin" / "__init__.py").write_text(PACKAGE)
    (site / "plugin" / "models" / "damped.yaml").write_text(YAML.format(name="damped"))
    (site / "plugin" / "signatures" / "there-and-back.yaml").write_text(
        "name: there-and-back\nmodel: damped\nperiods: 1\n"
        "segments: forward:u0 -> forward:u+ -> backward:u+ -> backward:u0 -> backward:u- -> forward:u-\n"
    )
    info = site / "plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: plugin\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    return site


def in_site(site: Path, code: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": f"{site}{os.pathsep}{Path(cf.__file__).parents[1]}"}
    return subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=500,
    )


def test_another_package_offers_models_and_signatures(site: Path) -> None:
    done = in_site(
        site,
        "import contfric as cf\nprint(*[n for n in cf.model_names() if 'plugin' in n or n == "
        "'damped'])\nprint(cf.load_model('damped').name, "
        "cf.load_model('class-of-plugin').modes[3].rank)\nsignature = "
        "cf.load_signature('there-and-back')\nprint(signature.model is cf.load_model('damped'), "
        "cf.signature_names('damped'))\ntry:\n    cf.load_model('broken-of-plugin')\nexcept cf.ModelError "
        "as error:\n    print(error)\ntry:\n    cf.load_model('dampd')\nexcept cf.ParameterError as "
        "error:\n    print(error)\n",
    )
    assert done.returncode == 0, done.stderr
    names, loaded, signature, broken, unknown = done.stdout.splitlines()
    assert names.split() == ["broken-of-plugin", "class-of-plugin", "damped"]
    assert loaded == "damped 1"
    assert signature == "True ['there-and-back']"
    assert "'broken-of-plugin'" in broken
    assert "RuntimeError: no licence" in broken
    assert "did you mean 'damped'?" in unknown


@pytest.fixture(scope="module")
def damped(tmp_path_factory: pytest.TempPathFactory) -> cf.Model:
    return typed(tmp_path_factory.mktemp("models"), YAML.format(name="damped"))


@pytest.fixture(scope="module")
def orbit(damped: cf.Model) -> cf.Orbit:
    return cf.find_orbit(damped)


def test_orbit_of_a_users_model_is_that_of_the_closed_form(orbit: cf.Orbit) -> None:
    values = {"Omega": 0.7, "S": 0.2, "S0": 0.2, "zeta": 0.05, "h": 0.0}
    closed = cf.find_orbit("coulomb", values)
    assert orbit.x_max == pytest.approx(closed.x_max, abs=1e-11)
    found, exact = (sorted(abs(o.multipliers)) for o in (orbit, closed))
    np.testing.assert_allclose(found, exact, atol=1e-9)


def test_models_can_be_pickled(damped: cf.Model) -> None:
    again = pickle.loads(pickle.dumps(damped))
    assert again.definition == damped.definition
    none = np.empty(0, dtype=np.int64)
    vector = again.vector({})
    assert again.flow.period(vector, none, np.empty(0)) == pytest.approx(2 * np.pi / 0.7)
    np.testing.assert_array_equal(again.spread({}), damped.spread({}))


def test_results_carry_their_model(orbit: cf.Orbit, tmp_path: Path) -> None:
    """Another process that never saw the model file reads the orbit, and computes with it."""
    cf.save(orbit, tmp_path / "orbit.npz")
    code = (
        f"import contfric as cf\norbit = cf.load({str(tmp_path / 'orbit.npz')!r})\nprint(repr(orbit.x_max), "
        "orbit.model.name)\n"
    )
    done = in_site(tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [repr(orbit.x_max), "damped"]


def test_damaged_definition_is_reported(orbit: cf.Orbit, tmp_path: Path) -> None:
    """With its digests made anew; with the old ones it is refused before it is read."""
    path = tmp_path / "orbit.npz"
    cf.save(orbit, path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    header = json.loads(bytes(arrays["header"]).decode())
    header["definition"] = header["definition"].replace("sign(v)", "sing(v)")
    del arrays["digests"]
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    arrays["digests"] = np.frombuffer(json.dumps(_digests(arrays)).encode(), dtype=np.uint8)
    np.savez(path, **arrays)
    with pytest.raises(cf.ResultFileError, match=r"did you mean 'sin'\?"):
        cf.load(path)


def test_studies_and_signatures_name_files_beside_them(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "damped.yaml").write_text(YAML.format(name="damped"))
    study = tmp_path / "study.yaml"
    study.write_text(
        "model: models/damped.yaml\nparams: {Omega: 0.7}\nstart: {signature: ./there.yaml}\n"
    )
    (tmp_path / "there.yaml").write_text(
        "name: there\nmodel: models/damped.yaml\nperiods: 1\n"
        "segments: forward:u0 -> forward:u+ -> backward:u+ -> backward:u0 -> backward:u- -> forward:u-\n"
    )
    from contfric.study import read_study

    read = read_study(study)
    assert read.model.name == "damped"
    assert read.signature is not None
    assert read.signature.model is read.model
    study.write_text("model: models/dampd.yaml\nstart: simulate\n")
    with pytest.raises(cf.StudyError, match=r"study.yaml:1: .*did you mean 'damped.yaml'\?"):
        read_study(study)


def test_commands_take_paths(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "damped.yaml"
    path.write_text(YAML.format(name="damped"))
    assert main(["graph", "--model", str(path)]) == 0
    assert "stick -> backward:u+ (F+)" in capsys.readouterr().out
    assert main(["simulate", "--model", str(path), "--periods", "2"]) == 0
    assert capsys.readouterr().out.startswith("cycle,phase,x,v,mode,surface")
    assert main(["graph", "--model", str(tmp_path / "damp.yaml")]) != 0
    assert "did you mean 'damped.yaml'?" in capsys.readouterr().err


class Walled(cf.OscillatorModel):
    """A forced mass with a wall."""

    states = ("x", "v")
    parameters: ClassVar = {"Omega": 0.7, "e": (0.8, "restitution"), "k": 1.0}
    surfaces: ClassVar = {"wall": ("x", 1), "stop": ("v", 0)}
    modes: ClassVar = {"free": {"wall": -1}}

    def period(self, p):  # type: ignore[no-untyped-def]
        return 2 * np.pi / p.Omega

    def field(self, mode, t, y, p):  # type: ignore[no-untyped-def]
        import sympy

        return {"x": y.v, "v": -where(y.x > 0, p.k, 1) * y.x + sympy.cos(p.Omega * t)}

    def reset(self, surface, t, y, p):  # type: ignore[no-untyped-def]
        return {"v": -p.e * y.v} if surface == "wall" else None


class Bristles(cf.OscillatorModel):
    """A mass on bristles, cut by the phase of its excitation."""

    states = ("x", "v", "z")
    parameters: ClassVar = {"Omega": 0.5, "S": 0.3, "k": 100.0}
    surfaces: ClassVar = {"phase": ("phase", 0)}
    modes: ClassVar = {"first": {"phase": 1}, "second": {"phase": -1}}
    kinks = ("v",)
    stop_surface = "v"
    max_step = 0.002

    def period(self, p):  # type: ignore[no-untyped-def]
        return 2 * np.pi / p.Omega

    def observables(self, t, y, p):  # type: ignore[no-untyped-def]
        return {"phase": functions.sin(p.Omega * t)}

    def field(self, mode, t, y, p):  # type: ignore[no-untyped-def]
        slip = y.v - p.k * abs(y.v) / p.S * y.z
        return y.v, functions.cos(p.Omega * t) - y.x - p.k * y.z, slip


def test_a_class_with_kinks_and_a_step_of_its_own() -> None:
    model = cf.load_model(Bristles)
    assert model.kinks == ("v",)
    assert model.stop_surface == "v"
    assert model.max_step == 0.002


def test_a_class_with_a_wall() -> None:
    model = cf.load_model(Walled)
    assert [r.surface for r in model.resets] == ["wall"]
    assert model.resets[0].changes == ("v",)
    state, jac, y = np.empty(2), np.empty((2, 3)), np.array([1.0, 0.5])
    none = np.empty(0, dtype=np.int64)
    model.flow.reset(0, 0.0, y, model.vector({}), none, state, jac)
    np.testing.assert_allclose(state, [1.0, -0.4])
    np.testing.assert_allclose(jac, [[0, 1, 0], [0, 0, -0.8]])


#: (what is changed in the class, what the error says)
WRONG = [
    ({"field": lambda self, mode, t, y, p: (y.w, 0)}, "no state 'w'"),
    ({"field": lambda self, mode, t, y, p: (y.v if y.x > 0 else 0, 0)}, "where"),
    ({"field": lambda self, mode, t, y, p: y.v}, "must return 2 formulas"),
    ({"field": lambda self, mode, t, y, p: (y.v, p.kk)}, "did you mean 'k'?"),
    ({"period": lambda self, p: np.sin(p.k)}, "contfric.models.functions"),
    ({"modes": {"free": {"wal": -1}}}, "did you mean 'wall'?"),
    ({"states": ()}, "a list of names"),
    ({"states": "xv"}, "a list of names"),
    ({"parameter": {"k": 2.0}}, "did you mean 'parameters'?"),
    ({"field": lambda self, mode, y, p: (y.v, 0)}, "write field(self, mode, t, y, p)"),
    ({"constraints": ("k > ",)}, "a constraint is such as"),
    ({"max_step": 0}, "as a share of the range"),
]


@pytest.mark.parametrize(("change", "says"), WRONG, ids=[w[1] for w in WRONG])
def test_mistakes_in_a_class(change: dict[str, object], says: str) -> None:
    with pytest.raises(cf.ModelError) as caught:
        cf.load_model(type("Wrong", (Walled,), change))
    assert says in str(caught.value)
    assert "Wrong" in str(caught.value)


def test_maps_in_several_processes(damped: cf.Model) -> None:
    """The model reaches other processes by its definition; the exponents are those of the closed form."""
    axes = {"Omega": [0.5, 0.7], "S": [0.1, 0.2]}
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        spread = cf.lyapunov_map(damped, axes, executor=executor, periods=60)
    np.testing.assert_array_equal(spread.values, cf.lyapunov_map(damped, axes, periods=60).values)
    for i, omega in enumerate(axes["Omega"]):
        for j, s in enumerate(axes["S"]):
            values = {"Omega": omega, "S": s, "S0": s, "zeta": 0.05}
            closed = cf.lyapunov_map("coulomb", {"Omega": [omega], "S": [s]}, values, periods=60)
            assert spread.values[i, j] == pytest.approx(closed.values[0, 0], abs=1e-8)


def test_a_map_of_a_users_model_goes_on_from_its_tiles(damped: cf.Model, tmp_path: Path) -> None:
    axes = {"Omega": [0.5, 0.6, 0.7], "S": [0.1, 0.2]}

    def stop(text: str) -> None:
        if text.startswith("Lyapunov map: 2 of 6"):
            raise KeyboardInterrupt

    how = {"periods": 60, "tile": 1}
    part = cf.lyapunov_map(damped, axes, folder=tmp_path / "tiles", progress=stop, **how)
    assert not part.complete
    said: list[str] = []
    whole = cf.lyapunov_map(damped, axes, folder=tmp_path / "tiles", progress=said.append, **how)
    assert whole.complete
    assert re.match(r"[23] of 6 tiles are in", said[0])
    assert whole.exponents.tobytes() == cf.lyapunov_map(damped, axes, **how).exponents.tobytes()
    other = tmp_path / "damped.yaml"
    other.write_text(YAML.format(name="damped").replace("2*zeta*v", "3*zeta*v"))
    said.clear()
    cf.lyapunov_map(other, axes, folder=tmp_path / "tiles", progress=said.append, **how)
    assert said[0].startswith("Lyapunov map: 1 of 6"), "tiles of another definition are not its own"


WORKERS = """\
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import contfric as cf

if __name__ == "__main__":
    axes = {"Omega": [0.5, 0.7], "S": [0.1, 0.2]}
    said = []
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        spread = cf.lyapunov_map(
            "damped", axes, executor=executor, periods=60, tile=1, progress=said.append
        )
    here = cf.lyapunov_map("damped", axes, periods=60)
    assert spread.exponents.tobytes() == here.exponents.tobytes()
    assert not [text for text in said if "lost" in text], said
    print(*spread.values.ravel())
"""


@pytest.mark.slow
def test_workers_find_the_model_of_another_package(
    site: Path, damped: cf.Model, tmp_path: Path
) -> None:
    """By its name alone, as an entry point of what is installed there; nothing is lost and computed here."""
    script = tmp_path / "workers.py"
    script.write_text(WORKERS)
    done = in_site(site, f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')")
    assert done.returncode == 0, done.stderr
    values = cf.lyapunov_map(damped, {"Omega": [0.5, 0.7], "S": [0.1, 0.2]}, periods=60).values
    assert [float(text) for text in done.stdout.split()] == values.ravel().tolist()


def test_models_work_without_a_cache(tmp_path: Path) -> None:
    """Where no folder can be written, the module of a model belongs to its process."""
    (tmp_path / "file").write_text("no folder")
    (tmp_path / "damped.yaml").write_text(YAML.format(name="damped"))
    code = (
        "import os, numpy as np\nos.environ['CONTFRIC_CACHE_DIR'] = "
        f"{str(tmp_path / 'file' / 'cache')!r}\nimport contfric as cf\nmodel = "
        f"cf.load_model({str(tmp_path / 'damped.yaml')!r})\nnone = np.empty(0, "
        "dtype=np.int64)\nprint(model.flow.period(model.vector({'Omega': 2 * np.pi}), none, np.empty(0)))\n"
    )
    done = in_site(tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == pytest.approx(1.0)
