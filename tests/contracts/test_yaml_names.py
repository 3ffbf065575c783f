"""Words that YAML 1.1 takes for true and false are names, everywhere; and texts with commas and colons."""

from __future__ import annotations

from pathlib import Path

import pytest

import contfric as cf
from contfric.base.yaml_lines import read_yaml
from contfric.models import load_model
from contfric.study import read_study

WORDS = ["on", "off", "yes", "no", "On", "OFF", "Yes", "NO", "y", "n", "Y", "N"]

MODEL = """
name: switch
parameters: {{Omega: 0.7, k: {{default: 3.0, meaning: stiffness}}}}
period: 2*pi/Omega
surfaces:
  {wall}: {{observable: x, level: 0.5, switching: {flag}}}
states: [x, v]
modes:
  {one}: {{in: {{{wall}: "-"}}, field: {{x: v, v: cos(Omega*t) - x - 0.1*v}}}}
  {other}: {{in: {{{wall}: "+"}}, field: {{x: v, v: cos(Omega*t) - k*x - 0.1*v}}}}
domains:
  {one}: {{mode: {one}, in: {{{wall}: "-"}}}}
  {other}: {{mode: {other}, in: {{{wall}: "+"}}}}
stop_surface: {wall}
"""


def write(tmp_path: Path, text: str, name: str = "file.yaml") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("word", WORDS)
def test_a_word_is_a_name_as_a_key_and_as_a_value(tmp_path, word) -> None:
    data = read_yaml(
        write(tmp_path, f"{word}: 1\na: {word}\nb: [{word}]\nc: {{{word}: {word}}}\n")
    ).data
    assert data == {word: 1, "a": word, "b": [word], "c": {word: word}}


@pytest.mark.parametrize("word", ["true", "True", "TRUE", "false", "False", "FALSE"])
def test_truth_is_true_and_false(tmp_path, word) -> None:
    assert read_yaml(write(tmp_path, f"a: {word}\n")).data == {"a": word.lower() == "true"}


@pytest.mark.parametrize(("one", "other"), [("on", "off"), ("yes", "no"), ("n", "y")])
@pytest.mark.parametrize("flag", ["true", "on", "yes"])
def test_modes_domains_and_surfaces_have_these_names(tmp_path, one, other, flag) -> None:
    text = MODEL.format(one=one, other=other, wall="wall", flag=flag)
    model = load_model(write(tmp_path, text))
    assert [m.name for m in model.modes if m.name not in model.phase_parts] == [one, other]
    assert list(dict.fromkeys(model.shown(d.name) for d in model.domains)) == [one, other]
    signature = cf.Signature(model, f"{one} -> {other}")
    assert signature.segments == (one, other)
    listed = f"segments: [{one}, {other}]\nperiods: 1\nname: {one}\n"
    again = write(tmp_path, f"model: {tmp_path / 'file.yaml'}\n{listed}", "s.yaml")
    read = cf.load_signature(again, model)
    assert (read, read.name) == (signature, one)


@pytest.mark.parametrize(
    ("word", "value"), [("off", False), ("no", False), ("on", True), ("true", True)]
)
def test_a_switch_of_a_study_takes_all_words(tmp_path, word, value) -> None:
    text = "model: coulomb\nparams: {Omega: 0.5}\n"
    text += f"explore: {{parameter: Omega, range: [0.4, 0.6], bridges: {word}}}\n"
    assert read_study(write(tmp_path, text)).content.explore.bridges is value


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("meaning: stiffness", "meaning: stiffness, of the spring", 3),
        ("switching: true", "switching: true, at the wall", 6),
    ],
)
def test_a_comma_in_a_text_is_explained(tmp_path, old, new, line) -> None:
    text = MODEL.format(one="a", other="b", wall="wall", flag="true").replace(old, new)
    with pytest.raises(cf.ModelError) as caught:
        load_model(write(tmp_path, text))
    assert f"file.yaml:{line}: unknown key" in str(caught.value)
    assert 'inside { } a text with a comma needs quotes: {meaning: "a, b"}' in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_comma_in_a_study_is_explained(tmp_path) -> None:
    text = "model: coulomb\nfigures: [{kind: orbit, file: mine, and yours}]\n"
    with pytest.raises(cf.StudyError, match=r":2: unknown key 'and yours'; inside \{ \} a text"):
        read_study(write(tmp_path, text))


def test_a_colon_in_a_text_is_explained(tmp_path) -> None:
    with pytest.raises(
        cf.StudyError, match=r":1: not valid YAML: .*; a text with ': ' in it needs"
    ):
        read_study(write(tmp_path, "title: friction: a study\nmodel: coulomb\n"))
