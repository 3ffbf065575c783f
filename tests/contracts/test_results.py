"""Results on disk: what is loaded is what was saved, and a damaged file says so."""

from __future__ import annotations

import dataclasses
import errno
import json
import struct
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.base import files
from contfric.bvp.system import build_system
from contfric.events.bifurcation import EndReason
from contfric.results.archive import _digests
from contfric.signature import load_signature

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def assert_same(a: object, b: object) -> None:
    """Compare dataclasses to their last bit, field by field; shared systems by what they solve."""
    assert type(a) is type(b)
    if isinstance(a, np.ndarray):
        assert isinstance(b, np.ndarray)
        assert (a.dtype, a.shape) == (b.dtype, b.shape)
        assert a.tobytes() == b.tobytes()
    elif isinstance(a, tuple):
        assert isinstance(b, tuple)
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            assert_same(x, y)
    elif dataclasses.is_dataclass(a) and not hasattr(a, "flow_factory"):
        for field in dataclasses.fields(a):
            # the accuracy of an event is computed when it is asked for, and saved with it
            name = "accuracy" if field.name == "bound" else field.name
            assert_same(getattr(a, name), getattr(b, name))
    elif isinstance(a, float):
        assert struct.pack("d", a) == struct.pack("d", b)
    else:
        assert a == b


def round_trip(x, tmp_path: Path):
    path = tmp_path / "x.npz"
    cf.save(x, path)
    return cf.load(path)


# --------------------------------------------------------------------------------- round trips


def test_orbit(orbit, tmp_path) -> None:
    loaded = round_trip(orbit, tmp_path)
    assert_same(orbit, loaded)
    assert loaded.signature == orbit.signature
    assert loaded.multipliers.tobytes() == orbit.multipliers.tobytes()


def test_full_form(orbit, tmp_path) -> None:
    signature = load_signature("1a")
    modes = [orbit.model.domain_by_name[d].mode for d in signature.segments]
    itinerary = tuple(zip(modes, signature.surfaces, strict=True))
    system = build_system(orbit.model, itinerary, 1, False, signature.segments)
    full = dataclasses.replace(orbit, system=system, joints=np.zeros((6, 3)))
    loaded = round_trip(full, tmp_path)
    assert loaded.system is system
    assert_same(full, loaded)


def test_unsolved_orbit(orbit, tmp_path) -> None:
    unsolved = dataclasses.replace(orbit, residual=np.inf, joints=orbit.joints * np.nan)
    assert_same(unsolved, round_trip(unsolved, tmp_path))


def test_branch(branch, tmp_path) -> None:
    loaded = round_trip(branch, tmp_path)
    assert_same(branch, loaded)
    ended = [end.bifurcation for end in loaded.ends if end.bifurcation is not None]
    assert ended
    assert all(any(b is listed for listed in loaded.bifurcations) for b in ended)


def test_branch_without_stability(orbit, tmp_path) -> None:
    branch = cf.continue_orbit(orbit, "S", (0.3, 0.33), stability=False)
    loaded = round_trip(branch, tmp_path)
    assert loaded.stable is None
    assert_same(branch, loaded)


def test_notes_of_a_branch(branch, tmp_path) -> None:
    noted = dataclasses.replace(branch, notes=("no BP at Omega = 0.5", "no SN at Omega = 0.51"))
    path = tmp_path / "branch.npz"
    cf.save(noted, path)
    assert cf.load(path).notes == noted.notes
    assert branch.mirror().notes == branch.notes == ()


def test_diagram(diagram, tmp_path) -> None:
    assert {b.mirrored for b in diagram.branches} == {True, False}
    assert {b.symmetric for b in diagram.branches} == {True, False}
    loaded = round_trip(diagram, tmp_path)
    assert_same(diagram, loaded)
    assert str(loaded) == str(diagram)
    for node in loaded.nodes:
        if not node.mirrored:
            branches = [loaded.branches[i] for i in node.branches]
            assert any(node.bifurcation is b for branch in branches for b in branch.bifurcations)
    assert sorted(loaded.graph.edges()) == sorted(diagram.graph.edges())


def test_interrupted_diagram(diagram, tmp_path) -> None:
    partial = dataclasses.replace(diagram, complete=False, notes=(EndReason.INTERRUPTED.value,))
    assert not round_trip(partial, tmp_path).complete


def test_continuation_goes_on_from_a_loaded_branch(branch, tmp_path) -> None:
    loaded = round_trip(branch, tmp_path)
    middle = len(branch) // 2
    again = cf.continue_orbit(loaded[middle], "Omega", (0.45, 0.56))
    want = cf.continue_orbit(branch[middle], "Omega", (0.45, 0.56))
    assert again.joints.tobytes() == want.joints.tobytes()


def test_saving_replaces_the_file(orbit, branch, tmp_path) -> None:
    path = tmp_path / "x.npz"
    cf.save(branch, path)
    cf.save(orbit, path)
    assert isinstance(cf.load(path), cf.Orbit)
    assert [p.name for p in tmp_path.iterdir()] == ["x.npz"]


def test_many_points_are_saved_as_arrays(branch, tmp_path) -> None:
    count = 200_000
    grown = {
        name: np.resize(getattr(branch, name), (count, *getattr(branch, name).shape[1:]))
        for name in ("values", "joints", "arc", "labels", "turn_multipliers")
    }
    large = dataclasses.replace(branch, **grown)
    path = tmp_path / "large.npz"
    start = time.process_time()
    cf.save(large, path)
    loaded = cf.load(path)
    seconds = time.process_time() - start
    path.unlink()
    assert loaded.joints.tobytes() == large.joints.tobytes()
    assert seconds < 4.0, "no point of a branch may be an object of its own on the way"


def test_loading_does_not_load_the_engine(branch, tmp_path) -> None:
    path = tmp_path / "x.npz"
    cf.save(branch, path)
    code = (
        "import sys, contfric as cf; print(len(cf.load(sys.argv[1])));"
        "assert not {'numba', 'matplotlib', 'pydantic'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == str(len(branch)), done.stderr


# ------------------------------------------------------------------------------ what is refused


def test_other_objects_are_refused(tmp_path) -> None:
    saved = r"only results can be saved \(Orbit, Branch, Diagram, Curve, QuantityCurve, Plane, .*\), got dict"
    with pytest.raises(cf.ResultFileError, match=saved):
        cf.save({}, tmp_path / "x.npz")  # type: ignore[arg-type]


def test_missing_file(tmp_path) -> None:
    with pytest.raises(cf.ResultFileError, match=r"cannot read .*none\.npz: No such file"):
        cf.load(tmp_path / "none.npz")
    with pytest.raises(cf.ResultFileError, match="cannot read"):
        cf.load(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.5, 0.9, 0.999])
def test_truncated_file(diagram, tmp_path, share) -> None:
    path = tmp_path / "diagram.npz"
    cf.save(diagram, path)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(cf.ResultFileError, match=r"diagram\.npz is damaged or incomplete .*again"):
        cf.load(path)


@pytest.mark.parametrize("name", ["orbit.csv", "orbit.mat"])
def test_a_table_is_not_saved_but_exported(orbit, tmp_path, name) -> None:
    with pytest.raises(cf.ParameterError, match=r"writes \.npz files, .*call cf\.export"):
        cf.save(orbit, tmp_path / name)
    assert not list(tmp_path.iterdir())
    assert cf.export(orbit, tmp_path / name)


def test_every_changed_byte_is_found_or_harmless(orbit, tmp_path) -> None:
    path = tmp_path / "orbit.npz"
    cf.save(orbit, path)
    content = path.read_bytes()
    for place in range(0, len(content), 7):
        changed = bytearray(content)
        changed[place] ^= 0x55
        path.write_bytes(changed)
        try:
            loaded = cf.load(path)
        except cf.ResultFileError:
            continue
        assert_same(orbit, loaded)  # a date or an attribute of the archive, not a number


@pytest.mark.parametrize("content", [b"", b"PK", b"x,y\n1,2\n", b"\x93NUMPY\x01\x00"])
def test_foreign_file(tmp_path, content) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(cf.ResultFileError, match="damaged or incomplete"):
        cf.load(path)


def test_foreign_npz(tmp_path) -> None:
    path = tmp_path / "x.npz"
    np.savez(path, values=np.arange(3.0))
    with pytest.raises(cf.ResultFileError, match="was not written by contfric"):
        cf.load(path)
    np.savez(path, header=np.array([{"mark": "contfric result"}], dtype=object))
    with pytest.raises(cf.ResultFileError, match="damaged"):
        cf.load(path)  # objects would be executed: they are not read


def edit(path: Path, name: str, change) -> None:
    """Change the bytes of an array, and the digests with them."""
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    arrays[name] = np.frombuffer(change(bytes(arrays[name])), dtype=np.uint8)
    del arrays["digests"]
    arrays["digests"] = np.frombuffer(json.dumps(_digests(arrays)).encode(), dtype=np.uint8)
    np.savez(path, **arrays)


def edit_header(path: Path, **changes: object) -> None:
    edit(path, "header", lambda content: json.dumps(json.loads(content) | changes).encode())


def edit_content(path: Path, change) -> None:
    """Change the tree of a result."""

    def changed(content: bytes) -> bytes:
        end = 8 + int.from_bytes(content[:8], "little")
        tree = json.dumps(change(json.loads(content[8:end]))).encode()
        return len(tree).to_bytes(8, "little") + tree + content[end:]

    edit(path, "content", changed)


def without(tree, name: str):
    """Return the node of an object without one of its fields."""
    return [*tree[:2], *(field for field in tree[2:] if field[0] != name)]


@pytest.mark.parametrize(
    "tree",
    [
        {},
        None,
        ["list"],
        ["cake"],
        ["object", "os:path"],
        ["object", "contfric.orbit.orbit:Cake"],
        ["enum", "contfric.orbit.orbit:Orbit", "__init__"],
        ["made", "contfric.orbit.orbit:Orbit"],
        ["array", "joints0"],
        ["seen", 3],
    ],
)
def test_content_is_checked(orbit, tmp_path, tree) -> None:
    path = tmp_path / "x.npz"
    cf.save(orbit, path)
    edit_content(path, lambda _: tree)
    with pytest.raises(cf.ResultFileError, match="damaged"):
        cf.load(path)


# ----------------------------------------------------------------- what is not as it was written


def flip(arrays, rng):
    """Change some bytes of one array."""
    name = rng.choice([n for n in arrays if arrays[n].size])
    content = bytearray(arrays[name].tobytes())
    for place in rng.integers(0, len(content), size=int(rng.integers(1, 5))):
        content[place] ^= int(rng.integers(1, 256))
    changed = np.frombuffer(bytes(content), arrays[name].dtype).reshape(arrays[name].shape)
    return arrays | {name: changed}, name


def zero(arrays, rng):
    name = rng.choice([n for n in arrays if np.any(arrays[n])])
    return arrays | {name: np.zeros_like(arrays[name])}, name


def drop(arrays, rng):
    name = rng.choice(list(arrays))
    return {n: a for n, a in arrays.items() if n != name}, name


def swap(arrays, rng):
    one, other = rng.choice(list(arrays), size=2, replace=False)
    return arrays | {one: arrays[other], other: arrays[one]}, one


def shorten(arrays, rng):
    name = rng.choice([n for n in arrays if arrays[n].size > 1])
    return arrays | {name: arrays[name][:-1]}, name


def reinterpret(arrays, rng):
    """Keep the bytes, and call them something else."""
    name = rng.choice([n for n in arrays if n != "digests"])
    return arrays | {name: arrays[name].view(np.int8)}, name


def add(arrays, rng):
    return arrays | {"branch99_values": rng.normal(size=3)}, "branch99_values"


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("mutate", [flip, zero, drop, swap, shorten, reinterpret, add])
def test_an_altered_array_is_refused(orbit, branch, diagram, tmp_path, mutate, seed) -> None:
    """The archive itself is sound: its check sums are those of the altered arrays."""
    rng = np.random.default_rng(seed)
    path = tmp_path / "x.npz"
    cf.save((orbit, branch, diagram)[seed % 3], path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    changed, name = mutate(arrays, rng)
    np.savez(path, **changed)
    if all(n in changed and changed[n].tobytes() == a.tobytes() for n, a in arrays.items()) and (
        mutate is swap
    ):
        pytest.skip("two arrays of the same bytes")
    with pytest.raises(cf.ResultFileError) as caught:
        cf.load(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(str(path))
    if name not in ("header", "digests") and mutate is not swap:
        assert name in line
    assert "restore a copy, or run its study again" in line or "not written by contfric" in line


def test_a_field_that_was_not_written_has_its_default(diagram, tmp_path) -> None:
    """An earlier version may have written less."""
    path = tmp_path / "x.npz"
    cf.save(dataclasses.replace(diagram, notes=("a note",)), path)
    edit_content(path, lambda tree: without(tree, "notes"))
    assert cf.load(path).notes == ()
    edit_content(path, lambda tree: without(tree, "parameter"))
    with pytest.raises(cf.ResultFileError, match=r"damaged .*'parameter' is missing"):
        cf.load(path)


def test_the_same_result_is_the_same_file(diagram, tmp_path) -> None:
    cf.save(diagram, tmp_path / "a.npz")
    cf.save(cf.load(tmp_path / "a.npz"), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 2}, "is in format 2, this contfric reads format 3: .* or run its study again"),
        ({"mark": "other"}, "was not written by contfric"),
        ({"model": "lugre7"}, "model 'lugre7', which is not installed .*pass load"),
        ({"parameters": ["Omega", "S"]}, r"was written for parameters \['Omega', 'S'\]"),
    ],
)
def test_header_is_checked(orbit, tmp_path, changes, message) -> None:
    path = tmp_path / "x.npz"
    cf.save(orbit, path)
    edit_header(path, **changes)
    with pytest.raises(cf.ResultFileError, match=message):
        cf.load(path)


def test_a_model_without_a_name_can_be_passed(orbit, tmp_path) -> None:
    own = dataclasses.replace(orbit.model, name="mine")
    system = build_system(own, orbit.system.itinerary, orbit.periods, orbit.system.half)
    path = tmp_path / "x.npz"
    cf.save(dataclasses.replace(orbit, system=system), path)
    with pytest.raises(cf.ResultFileError, match="'mine', which is not installed"):
        cf.load(path)
    from contfric.results import load

    assert load(path, own).model is own
    with pytest.raises(cf.ResultFileError, match="was written for model mine"):
        load(path, orbit.model)


# ------------------------------------------------------------------------------- whole or not


@pytest.mark.parametrize(
    ("code", "remedy"),
    [
        (errno.ENOSPC, "free some space"),
        (errno.EROFS, "read-only: write to another"),
        (errno.EIO, "write to another place"),
    ],
)
def test_a_failed_write_leaves_the_old_file(orbit, tmp_path, monkeypatch, code, remedy) -> None:
    path = tmp_path / "x.npz"
    path.write_text("precious")

    def refuse(*_: object) -> None:
        raise OSError(code, "refused")

    monkeypatch.setattr(files.os, "fsync", refuse)
    with pytest.raises(cf.ResultFileError, match=rf"cannot write .*x\.npz: refused; .*{remedy}"):
        cf.save(orbit, path)
    assert path.read_text() == "precious"
    assert [p.name for p in tmp_path.iterdir()] == ["x.npz"]


def test_an_interrupted_write_leaves_the_old_file(orbit, tmp_path, monkeypatch) -> None:
    path = tmp_path / "x.npz"
    path.write_text("precious")

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(zipfile.ZipFile, "open", interrupt)
    with pytest.raises(KeyboardInterrupt):
        cf.save(orbit, path)
    assert path.read_text() == "precious"
    assert [p.name for p in tmp_path.iterdir()] == ["x.npz"]


def test_missing_folder_is_named(orbit, tmp_path) -> None:
    with pytest.raises(cf.ResultFileError, match=r"make the folder .*none first"):
        cf.save(orbit, tmp_path / "none" / "x.npz")
    missing = OSError(
        errno.ENOENT, "No such file or directory"
    )  # as where a system makes no folders
    assert files.unwritable(tmp_path / "x", missing).endswith("write to another place")
