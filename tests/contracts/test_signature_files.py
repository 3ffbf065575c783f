"""Signature notation and files: what is accepted, and what the errors say."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from contfric.base.resources import bundled_dir
from contfric.errors import ContfricError, NotationError
from contfric.models import load_model
from contfric.signature import (
    Signature,
    load_signature,
    parse_signature,
    signature_names,
    signature_path,
)

COULOMB = load_model("coulomb")
BUNDLED = ["0s", "1a", "1a-9seg", "2a", "2a-14seg", "2s"]
HEAD = "name: test\nmodel: coulomb\n"
WALK = "segments: x0v+ -> stick -> x-v+\n"


# ------------------------------------------------------------------------------ bundled files


def test_bundled_names() -> None:
    assert signature_names() == BUNDLED
    assert signature_names("coulomb") == BUNDLED
    assert signature_names("no such model") == []


@pytest.mark.parametrize("stem", BUNDLED)
def test_bundled_file_is_complete(stem: str) -> None:
    signature = load_signature(stem)
    assert signature.name == stem.replace("-", ", ")
    assert load_signature(signature.name) == signature
    assert load_signature(signature_path(stem)) == signature
    assert load_signature(str(signature_path(stem)), "coulomb") == signature
    assert set(signature.example or {}) <= set(COULOMB.parameter_names)
    assert COULOMB.check_params(signature.example or {})


def test_signature_object_is_returned_as_it_is() -> None:
    signature = load_signature("1a")
    assert load_signature(signature, COULOMB) is signature


def test_unknown_name_is_answered() -> None:
    with pytest.raises(NotationError, match=r"unknown signature '1s'.*Valid: 0s, 1a"):
        load_signature("1s")


def test_other_model_is_refused() -> None:
    other = dataclasses.replace(COULOMB, name="other")
    with pytest.raises(NotationError, match=r"1a\.yaml:2: .*of model 'coulomb', not of 'other'"):
        load_signature("1a", other)
    with pytest.raises(NotationError, match="of model 'coulomb', not of 'other'"):
        load_signature(load_signature("1a"), other)
    with pytest.raises(NotationError, match="a name, a path or a Signature, got int"):
        load_signature(1)  # type: ignore[arg-type]


def test_model_without_entry_point_may_be_passed(write) -> None:
    other = dataclasses.replace(COULOMB, name="other")
    path = write("name: mine\nmodel: other\n" + WALK)
    assert load_signature(path, other).model is other
    with pytest.raises(NotationError, match=r"scene\.yaml:2: unknown model 'other'"):
        load_signature(path)


def test_unknown_kind_of_resource() -> None:
    with pytest.raises(ContfricError, match="no bundled 'signature'; did you mean 'signatures'"):
        bundled_dir("signature")  # type: ignore[arg-type]


# -------------------------------------------------------------------------------- entry points


def offer(monkeypatch: pytest.MonkeyPatch, loaded: object) -> None:
    entry = SimpleNamespace(name="plugin", load=lambda: loaded)
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: [entry])


@pytest.mark.parametrize("kind", [str, Path, lambda folder: lambda: folder])
def test_entry_point_adds_a_folder(write, tmp_path, monkeypatch, kind) -> None:
    write("name: mine\nmodel: coulomb\n" + WALK, "mine-file.yml")
    write("name: [", "broken.yaml")
    offer(monkeypatch, kind(tmp_path))
    assert load_signature("mine").stops == load_signature("mine-file").stops == 1
    assert "mine-file" in signature_names()
    with pytest.raises(NotationError, match=r"Unreadable: .*broken\.yaml"):
        load_signature("nothing like it")


def test_entry_point_cannot_replace_a_bundled_file(write, tmp_path, monkeypatch) -> None:
    write("name: 1a\nmodel: coulomb\n" + WALK, "1a.yaml")
    offer(monkeypatch, tmp_path)
    assert len(load_signature("1a").segments) == 6


def test_model_decides_between_equal_names(write, tmp_path, monkeypatch) -> None:
    other = dataclasses.replace(COULOMB, name="other")
    write("name: 1a\nmodel: other\n" + WALK, "1a.yaml")
    offer(monkeypatch, tmp_path)
    assert len(load_signature("1a", other).segments) == 3


def test_broken_entry_point_is_named(monkeypatch) -> None:
    offer(monkeypatch, 7)
    assert load_signature("1a").stops == 1
    with pytest.raises(NotationError, match=r"entry point 'plugin'.* gives no folder: 7"):
        signature_names()


# --------------------------------------------------------------------------- errors with lines


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "must be a mapping"),
        ("- a\n", 1, "must be a mapping"),
        ("name: [\n", 2, "not valid YAML"),
        ("name: a\n---\nname: b\n", 2, "not valid YAML"),
        ("name: a\x00\n", 1, "not valid YAML"),
        ("name: 2020-99-99\n", 1, "not valid YAML"),
        (HEAD + WALK + "period: 2\n", 4, "unknown key 'period'; did you mean 'periods'"),
        (HEAD + WALK + "3: 2\n", 4, "unknown key '3'"),
        (HEAD + WALK + "name: b\n", 4, r"key 'name' is given twice \(first in line 1\)"),
        (HEAD, 1, "key 'segments' is missing"),
        ("name: 7\nmodel: coulomb\n" + WALK, 1, "'name' must be a text .*got 7"),
        ("name: a\nmodel: colomb\n" + WALK, 2, "unknown model 'colomb'; did you mean 'coulomb'"),
        (HEAD + "periods: 1.5\n" + WALK, 3, r"'periods' must be a whole number >= 1, got 1\.5"),
        (HEAD + "periods: true\n" + WALK, 3, "'periods' must be a whole number"),
        (HEAD + "periods: 0\n" + WALK, 3, "'periods' must be a whole number >= 1, got 0"),
        (HEAD + "segments: 3\n", 3, "'segments' must be a text"),
        (HEAD + "segments:\n", 3, "'segments' must be a text"),
        (HEAD + "segments: ''\n", 3, "needs segments"),
        (HEAD + "segments:\n  - x0v+\n  - 3\n", 5, "'segments' must be a text"),
        (HEAD + "segments:\n  - x0v+\n  - stik\n", 5, "did you mean 'stick'"),
        (HEAD + "segments: [x0v+, x-v-]\n", 3, "cannot be followed by segment 2 'x-v-'"),
        (HEAD + WALK + "symmetric: yes please\n", 4, "'symmetric' must be true or false"),
        (HEAD + WALK + "symmetric: true\n", 4, "cannot be symmetric"),
        (HEAD + WALK + "example: 3\n", 4, "'example' must be a mapping"),
        (HEAD + WALK + "example:\n  Omega: 0.5\n  h: '1e-3'\n", 6, "got h: '1e-3'"),
        (HEAD + WALK + "example:\n  Omga: 0.5\n", 5, "no parameter 'Omga'; did you mean 'Omega'"),
        (HEAD + WALK + "example: {1: 0.5}\n", 4, "'example' must be a mapping"),
        (HEAD + WALK + "example: {S: 0.5, S0: 0.4}\n", 4, "needs S0 >= S"),
        (HEAD + WALK + "example: {S: .nan}\n", 4, "must be finite"),
        (HEAD + WALK + "example: &a {S: *a}\n", 4, "an alias stands within what it names"),
    ],
)
def test_error_names_file_and_line(write, text: str, line: int, message: str) -> None:
    path = write(text)
    with pytest.raises(NotationError, match=message) as caught:
        load_signature(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(NotationError, match=r"cannot read .*none\.yaml: No such file"):
        load_signature(tmp_path / "none.yaml")
    with pytest.raises(NotationError, match="cannot read"):
        load_signature(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"name: \xe9\n")
    with pytest.raises(NotationError, match=r"latin\.yaml:1: is no UTF-8 .*; save it as UTF-8"):
        load_signature(tmp_path / "latin.yaml")


def test_file_with_arrows_and_list(write) -> None:
    expected = parse_signature("x0v+ -> stick -> x-v+", COULOMB)
    assert load_signature(write(HEAD + "segments: x0v+→x0v0 → x-v+\n")) == expected
    assert load_signature(write(HEAD + "segments: [stick, x-v+, x0v+]\n")) == expected


# ------------------------------------------------------------------------------------ notation


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "needs segments, got none"),
        ("  \n", "needs segments, got none"),
        ([], "needs segments, got none"),
        ("stick", "single segment 'stick' is no closed walk"),
        ("x0v+ -> ", "segment 2: nothing between two arrows"),
        ("x0v+ stick -> x-v+", "lacks an arrow; write x0v\\+ -> stick"),
        ("x0v+, stick, x-v+", "has no domain 'x0v\\+, stick, x-v\\+'"),
        ("x0v+ -> stik -> x-v+", "segment 2: .*no domain 'stik'; did you mean 'stick'"),
        ("x0v+ -> x0v+", "segment 1 'x0v\\+' cannot be followed by segment 2 'x0v\\+'"),
        (
            "x-v+ -> stick",
            "segment 1 'x-v\\+' cannot be followed by segment 2 'stick'. "
            "After x-v\\+ can come: x0v\\+ \\(through F-\\)",
        ),
        (
            "x0v+ -> stick -> x+v-",
            "not closed: the last segment 3 'x\\+v-' cannot lead back to the first, 'x0v\\+'. "
            "After x\\+v- can come: x0v- \\(through F\\+\\)",
        ),
    ],
)
def test_notation_errors(text: str | list[str], message: str) -> None:
    with pytest.raises(NotationError, match=message):
        parse_signature(text, COULOMB)


@pytest.mark.parametrize("periods", [0, -1, 1.0, True, "1"])
def test_periods_must_be_a_count(periods) -> None:
    with pytest.raises(NotationError, match="periods must be a whole number >= 1"):
        parse_signature("x0v+ -> stick -> x-v+", COULOMB, periods)


def test_contradicting_symmetry_is_refused() -> None:
    walk = load_signature("2s").segments
    with pytest.raises(NotationError, match="cannot be symmetric"):
        Signature(COULOMB, walk, periods=2, symmetric=True)
    with pytest.raises(NotationError, match="has no half"):
        load_signature("1a").half()


def test_model_without_symmetry() -> None:
    plain = dataclasses.replace(COULOMB, name="plain", symmetry=None)
    signature = parse_signature("x0v+ -> stick -> x-v+", plain)
    assert not signature.is_mirror_symmetric
    with pytest.raises(NotationError, match="has no symmetry"):
        signature.mirror()


def test_text_forms() -> None:
    signature = load_signature("1a")
    assert str(signature) == "x0v+ -> x+v+ -> x+v- -> x0v- -> stick -> x-v+"
    assert repr(signature) == f"Signature('{signature}', 'coulomb', periods=1, name='1a')"


def test_import_needs_no_heavy_package() -> None:
    heavy = ("numba", "scipy", "networkx", "matplotlib", "yaml", "pydantic")
    code = f"import sys, contfric.signature; print(*[m for m in {heavy!r} if m in sys.modules])"
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []
