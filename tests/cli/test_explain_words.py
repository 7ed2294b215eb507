"""What ``onboard explain`` says in a terminal: its labels agree with its verdict."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from onboard.answers.answer import Answer
from onboard.answers.explain import Explanation
from onboard.answers.recorded_vehicle import Vehicle
from onboard.answers.replay import Reading
from onboard.answers.verdict import lacks
from onboard.cli.explain import summary
from onboard.core.diagnosis.records import Diagnosis, Inconstant, Verdict
from onboard.recordings.recording import Recording
from onboard.report.explain import explain_html
from tests.report.diagnoses_by_hand import calibration, diagnosis, effect
from tests.report.html_page import Page

DOUBT = "the latency of GPS may not be the same in parts of the flight (310 ms, 110 ms)"
CLEAN = diagnosis(verdict=Verdict.CLEAN, effects=())
DOUBTFUL = diagnosis(
    verdict=Verdict.CLEAN,
    effects=(),
    inconstant=(Inconstant("gps_latency", DOUBT, contradicts=False),),
)
UNEXPLAINED = diagnosis(verdict=Verdict.UNEXPLAINED, effects=())
SPOILED = diagnosis(effects=(effect("throttle_coupling", parameters={}),))


def said(made: Diagnosis) -> str:
    recording = Recording(Path("flight.BIN"), "dataflash", "ardupilot", 80.0, {}, iter)
    console = Console(file=io.StringIO(), width=80)
    for part in summary(Explanation(Answer(made), Reading((recording,), Vehicle()), {})):
        console.print(part)
    return console.file.getvalue()


def page(made: Diagnosis) -> str:
    html = explain_html(
        made, files=("flight.BIN",), autopilot="ardupilot", duration_s=80.0, advice=None
    )
    return Page.of(html).words


@pytest.mark.parametrize("made", [CLEAN, DOUBTFUL, UNEXPLAINED, SPOILED])
def test_nothing_is_listed_as_missing_where_nothing_is(made):
    text = said(made)
    nothing = "Nothing is missing" in text
    assert nothing == (made.verdict is Verdict.CLEAN)
    assert nothing != lacks(made)
    assert nothing != any(line.startswith("Missing") for line in text.splitlines())
    assert nothing != ("What is missing" in page(made))


def test_a_doubt_is_told_beside_a_clean_verdict():
    text = " ".join(said(DOUBTFUL).split())
    assert f"To know {DOUBT[0].upper()}{DOUBT[1:]}." in text


@pytest.mark.parametrize(
    ("observable", "words"),
    [((True,) * 6, "calibrated"), ((True,) * 5 + (False,), "calibrated in part")],
)
def test_what_a_flight_shows_in_part_is_called_so_here_as_in_a_replay(observable, words):
    text = said(diagnosis(calibration=calibration(observable=observable)))
    (heading,) = [line for line in text.splitlines() if "calibration:" in line]
    assert heading.split("calibration:")[1].split("  ")[0].strip() == words
    assert max(map(len, text.splitlines())) <= 80
