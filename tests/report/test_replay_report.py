"""The page of a replay: what a watched calibrator keeps, and what is shown of it."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.chronicle import FREE_S, PAUSE_S
from onboard.answers.recorded import Recorded, unanswered
from onboard.answers.replay import replay
from onboard.answers.words import seconds
from onboard.core.estimate.observability import SIX_NAMES
from onboard.core.estimate.result import Estimate, Status
from onboard.report.replay import replay_html
from sitl import recording
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec
from tests.report.html_page import Page

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
SIX = np.array([*TRUE.scale, *TRUE.offset])


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "<b>flight.tlog"
    recording.write_tlog(FlightSpec(vehicle="copter", duration=100.0, imus=(TRUE,)), path)
    return path


@pytest.fixture(scope="module")
def told(flight):
    recorded = Recorded(watched=True)
    return replay([flight], recorded), recorded.chronicle


@pytest.mark.slow
def test_watching_changes_nothing(flight, told):
    result, _ = told
    plain = replay([flight], Recorded())
    assert plain.calibrations[0].scale == result.calibrations[0].scale
    assert plain.calibrations[0].covariance == result.calibrations[0].covariance
    assert plain.counts == result.counts


@pytest.mark.slow
def test_the_course_ends_at_the_answer_and_narrows_towards_the_truth(told):
    result, chronicle = told
    answer, course = result.calibrations[0], chronicle.figures(1).course
    assert np.all(np.diff(course.t) >= 0.0)
    np.testing.assert_allclose(course.value[-1], [*answer.scale, *answer.offset])
    np.testing.assert_allclose(course.sigma[-1], [*answer.scale_sigma, *answer.offset_sigma])
    np.testing.assert_allclose(course.coverage[-1], answer.coverage.per_parameter)
    assert np.all(course.sigma[-1] < 0.5 * course.sigma[0])
    assert np.all(np.abs(course.value[-1] - SIX) < 4.0 * course.sigma[-1])


def test_calibrated_drifts_less_and_begins_anew_at_zero(told):
    figures = told[1].figures(1)
    before, after = figures.before, figures.after
    begins = np.isnan(after.y)
    assert np.array_equal(begins, np.isnan(before.y))
    assert np.max(np.diff(after.t[begins])) < FREE_S + 1.0
    assert np.nanmedian(after.y) < 0.2 * np.nanmedian(before.y)


def test_trust_is_told_without_gaps_and_agrees_with_the_window(told):
    result, chronicle = told
    spans = chronicle.spans
    assert spans[0].start == 0.0
    assert all(a.end == b.start and a.reason != b.reason for a, b in itertools.pairwise(spans))
    trusted = sum(s.seconds for s in spans if not s.reason)
    assert trusted == pytest.approx(chronicle.calibrator.trust.trusted_s, abs=1.0)
    assert chronicle.duration_s == pytest.approx(result.duration_s, abs=2.0)


@pytest.mark.slow
def test_a_second_recording_is_drawn_after_the_first(flight, told, tmp_path):
    once = told[1].duration_s
    again = tmp_path / "again.tlog"
    spec = FlightSpec(vehicle="copter", seed=2, duration=100.0, imus=(TRUE,))
    recording.write_tlog(spec, again)
    recorded = Recorded(watched=True)
    replay([flight, again], recorded)
    chronicle = recorded.chronicle
    figures = chronicle.figures(1)
    assert chronicle.duration_s == pytest.approx(2.0 * once + PAUSE_S, abs=0.1)
    assert figures.course.t[-1] > once + PAUSE_S
    for curve in (figures.after, figures.innovation):
        assert np.all(np.diff(curve.t) >= 0.0)
        assert np.any(curve.t < once)
        assert np.any(curve.t > once + PAUSE_S)


def test_the_page_is_complete_and_stands_alone(told):
    html = replay_html(*told)
    page = Page.of(html)
    assert not re.search(r"https?:|//[a-z]|@import|url\(|<b>", html)
    assert html.count("<script") == 1  # ours
    assert not re.search(r"\b(nan|inf)\b", html, re.IGNORECASE)
    assert len(html.encode()) < 300_000
    assert told[0].calibrations[0].status is Status.CALIBRATED
    for said in ("Calibrated", "INS_ACCOFFS_Z", "Certificate", "When GPS was trusted", *SIX_NAMES):
        assert said in page.words
    assert len(re.findall('class="ribbon', html)) == len(SIX_NAMES)


@pytest.mark.slow
def test_a_recording_of_a_hop_says_so_and_what_to_fly(tmp_path):
    path = tmp_path / "dull.tlog"
    spec = FlightSpec(vehicle="copter", duration=32.0, imus=(TRUE,), dull=True)
    recording.write_tlog(spec, path)
    recorded = Recorded(watched=True)
    page = Page.of(replay_html(replay([path], recorded), recorded.chronicle))
    assert "Calibrated" not in page.words.replace("calibrated", "")
    assert "To fly next" in page.words
    assert "The flight does not show enough" in page.words


def test_what_is_not_known_is_said_in_words(told):
    result, _ = told
    nan = math.nan
    nothing = replace(
        result.calibrations[0],
        status=Status.INSUFFICIENT,
        scale=(nan,) * 3,
        scale_sigma=(math.inf,) * 3,
        observable=(False,) * 6,
        held_out_before=nan,
        velocity_rms_before=nan,
        timing={"gps_delay_s": Estimate(nan, nan)},
        certificate=None,
        dead_reckoning=None,
    )
    unwatched = Recorded(watched=True).chronicle
    html = replay_html(replace(result, answers=(unanswered(nothing),)), unwatched)
    page = Page.of(html)
    assert not re.search(r"\b(nan|inf)\b", html, re.IGNORECASE)
    assert "no data to draw" in page.words
    assert "not known" in page.words


@pytest.mark.parametrize(
    ("value", "sigma", "said"),
    [
        (0.4512, 0.2213, "451 ± 220 ms"),
        (0.0811, 0.0021, "81.1 ± 2.1 ms"),
        (-0.0176, 0.0007, "−17.60 ± 0.70 ms"),
        (0.0567, math.inf, "56.7 ms"),
    ],
)
def test_times_are_said_in_the_digits_that_their_sigma_supports(value, sigma, said):
    assert seconds(value, sigma) == said
