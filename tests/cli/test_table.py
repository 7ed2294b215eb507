from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from onboard.answers.recorded import unanswered
from onboard.answers.replay import Replay
from onboard.cli.table import replay_report
from onboard.recordings.recording import Recording
from tests.cli.results import CALIBRATED, NOTHING_KNOWN


def shown(*calibrations: object, autopilot: str = "ardupilot", **about: object) -> str:
    recording = Recording(
        Path("a-flight-with-a-rather-long-name.tlog"), "tlog", autopilot, 261.2, {}, iter, **about
    )
    out = io.StringIO()
    console = Console(file=out, width=80)
    for part in replay_report(Replay((recording,), tuple(map(unanswered, calibrations)), {})):
        console.print(part)
    return out.getvalue()


def test_it_fits_into_eighty_columns():
    text = shown(
        CALIBRATED, replace(CALIBRATED, imu=3), NOTHING_KNOWN, damage=("2 damaged places",) * 3
    )
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text


def test_it_says_what_to_set_and_what_was_seen():
    lines = shown(CALIBRATED).splitlines()
    row = next(line for line in lines if "INS_ACCSCAL_X" in line)
    assert row.split() == ["x", "scale", "1.0010", "1.0240", "0.0011", "INS_ACCSCAL_X", "yes"]
    assert next(line for line in lines if "INS_ACCOFFS_Z" in line).split()[-1] == "together"
    text = " ".join(" ".join(lines).split())
    assert "Accelerometer 1: calibrated" in text
    assert "GPS is 81 ± 2 ms late" in text
    assert "251 s of GPS, not used: gps glitch 3, no fix 12" in text
    assert "velocity error below 0.90 m/s over 251 s; 0.31 m/s was seen" in text
    assert "12.1 m/s as it is, 0.4 m/s calibrated" in text
    assert "83 %, weakest: z scale" in text
    assert "fly banked turns" in text


def test_what_is_not_known_is_not_made_up():
    text = shown(NOTHING_KNOWN)
    assert "nan" not in text
    assert "inf" not in text.replace("information", "")
    assert "does not show enough" in text
    assert "scale 1 and offset 0 are assumed" in " ".join(text.split())


def test_px4_gets_advice_without_parameters():
    text = shown(CALIBRATED, autopilot="px4", notes=("advice only",))
    assert "INS_ACC" not in text
    assert "PX4" in text


@pytest.mark.parametrize("name", ["[bold]x.tlog", "[nonsense].tlog"])
def test_file_names_are_not_markup(name):
    recording = Recording(Path(name), "tlog", "ardupilot", 1.0, {}, iter)
    console = Console(file=io.StringIO(), width=80)
    for part in replay_report(Replay((recording,), (unanswered(CALIBRATED),), {})):
        console.print(part)
    assert name in console.file.getvalue()


def test_a_name_that_is_longer_than_a_line_is_told_to_its_end():
    name = f"{'the-flight-of-monday-' * 5}end.tlog"
    recording = Recording(Path(name), "tlog", "ardupilot", 1.0, {}, iter)
    out = io.StringIO()
    console = Console(file=out, width=80)
    for part in replay_report(Replay((recording,), (unanswered(CALIBRATED),), {})):
        console.print(part)
    assert name in "".join(out.getvalue().split())
    assert max(map(len, out.getvalue().splitlines())) <= 80
