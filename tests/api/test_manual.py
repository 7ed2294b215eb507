"""docs/python.md: its examples run, and it has every public name and no other."""

from __future__ import annotations

import dataclasses
import doctest
import re
from pathlib import Path

import pytest

import onboard

MANUAL = Path(__file__).resolve().parents[2] / "docs" / "python.md"
TEXT = MANUAL.read_text(encoding="utf-8")
WORDS = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)
SPANS = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", WORDS))))


@pytest.mark.slow
def test_the_examples_give_what_they_say(asked, tmp_path, monkeypatch):
    """On the flight that every test here has; what was worked out already is not done again."""
    (tmp_path / "flight.tlog").write_bytes(asked.path.read_bytes())
    monkeypatch.chdir(tmp_path)
    known = {"flight.tlog": asked.calibration}
    calibrate = onboard.calibrate

    def once(source):
        if isinstance(source, onboard.Arrays):
            return asked.by_columns if source.told is None else asked.by_arrays
        return known.get(source) or calibrate(source)

    monkeypatch.setattr(onboard, "calibrate", once)
    monkeypatch.setattr(onboard, "explain", lambda _: asked.explanation)
    monkeypatch.setattr(onboard, "match", lambda _: asked.match)
    i, a = asked.columns["inertial"], asked.columns["attitude"]
    v = asked.columns["velocity"]
    names = {"t": i.t, "f_b": i.f_b, "w_b": i.w_b, "t_attitude": a.t, "roll": a.roll}
    names |= {"pitch": a.pitch, "yaw": a.yaw, "t_gps": v.t, "v_n": v.v_n}
    names["accuracy"] = v.speed_accuracy
    examples = doctest.DocTestParser().get_doctest(TEXT, names, "python.md", str(MANUAL), 0)
    assert len(examples.examples) > 15
    said = []
    flags = doctest.ELLIPSIS | doctest.REPORT_NDIFF
    doctest.DocTestRunner(optionflags=flags).run(examples, out=said.append)
    assert not said, "".join(said)


@pytest.mark.parametrize("name", onboard.__all__)
def test_every_name_is_in_the_manual(name):
    assert name in SPANS


@pytest.mark.parametrize(
    "kind", [k for n in onboard.__all__ if dataclasses.is_dataclass(k := getattr(onboard, n))]
)
def test_every_field_and_method_is_in_the_manual(kind):
    said = {f.name for f in dataclasses.fields(kind)}
    said |= {n for n in dir(kind) if callable(getattr(kind, n))}
    hidden = {n for n in said if n.startswith("_")} | {"of"}
    if kind is onboard.Told:
        hidden |= {"samples", "damage", "notes", "duration_s"}
    assert said - hidden <= SPANS
