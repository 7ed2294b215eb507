"""Recordings that are explained together: one flight, or said to be none."""

from __future__ import annotations

import json

import numpy as np
import pytest

from onboard.answers.explain import explain
from onboard.answers.recorded import Recorded
from onboard.answers.replay import read
from onboard.cli.explain import summary
from onboard.core.diagnosis.one_flight import contradiction
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import Status
from onboard.report.explain import explanation_html
from onboard.report.parameters import explanation_text
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec
from tests.recordings.dated import flown
from tests.report.html_page import Page

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SIX = np.array([*TRUE.scale, *TRUE.offset])
PLACE = (0.7, 0.0, -0.4)
TOLD = {"GPS1_POS_X": 0.7, "GPS1_POS_Z": -0.4}
FLIGHTS = {
    "plain": {"seed": 1},
    "again": {"seed": 2},
    "later": {"seed": 3, "gps": GpsTruth(delay=0.2)},
    "untold": {"seed": 4, "gps": GpsTruth(antenna=PLACE)},
    "told": {"seed": 5, "gps": GpsTruth(antenna=PLACE), "parameters": TOLD},
}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    return {
        name: flown(
            FlightSpec(duration=110.0, imus=(TRUE,), loop_rate=200, **more),
            folder / f"{name}.tlog",
            day,
        )
        for day, (name, more) in enumerate(FLIGHTS.items())
    }


@pytest.fixture(scope="module")
def differing(files):
    return {
        what: explain([files["plain"], files[what]])
        for what in ("later", "untold", "told")  # the antenna was moved, and nobody told, or did
    }


def right(calibration):
    off = np.array(calibration.scale + calibration.offset) - SIX
    sigma = np.array(calibration.scale_sigma + calibration.offset_sigma)
    return bool(np.all(np.abs(off) < 4.0 * sigma))


def test_what_is_one_flight_has_one_answer(files):
    made = explain([files["plain"], files["again"]])
    assert made.diagnosis.split == ""
    assert made.diagnosis.verdict in {Verdict.CLEAN, Verdict.EXPLAINED}
    assert right(made.diagnosis.calibration)


def test_an_antenna_that_was_told_in_between_is_where_it_was(files):
    made = explain([files["untold"], files["told"]])
    d = made.diagnosis
    assert d.split == ""
    assert not {"gps_lever_arm", "gps_smoothing", "clock_skew"} & {e.name for e in d.effects}
    assert d.calibration.status is Status.CALIBRATED
    assert right(d.calibration)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("later", "the latency of GPS"),
        ("untold", "the antenna's place along x"),
        ("told", "the antenna's place along x"),
    ],
)
def test_what_differs_in_timing_or_antenna_is_said_to_be_no_one_flight(differing, what, words):
    made = differing[what]
    d = made.diagnosis
    assert d.verdict is Verdict.INSUFFICIENT
    assert d.effects == ()
    assert d.calibration.status is Status.INSUFFICIENT
    assert not np.any(np.isfinite(d.calibration.scale + d.calibration.offset))
    assert words in d.split
    assert not made.advice.settable
    document = json.loads(made.document().to_json())
    assert document["headline"] == "These recordings are not one flight."
    assert f"{what}.tlog" in document["note"]
    assert "# These recordings are not one flight" in explanation_text(made, "x.param")
    page = Page.of(explanation_html(made))
    assert "are not one flight" in page.words
    text = " ".join(str(getattr(part, "plain", "")) for part in summary(made))
    assert "are not one flight" in text


def test_a_flight_contradicts_no_part_of_itself(files):
    recorded = Recorded((1,))
    read([files["untold"]], recorded)
    recorded.answer(1)
    engine = recorded.engine(1)
    start, end = engine.all_blocks[0].start, engine.all_blocks[-1].end
    for parts in (2, 3):
        begins = [start + k * (end - start) / parts for k in range(parts)]
        assert contradiction(engine, begins) is None
