"""A simulated flight with one concealed effect: found, and told in JSON, HTML and parameters."""

import json
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from onboard.answers.explain_document import explain_document
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Mismatch, Series, Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.mavlink.decode import Decoder
from onboard.report.explain import explain_html
from onboard.report.parameters import parameter_text
from sitl.builtin.effects import GpsLeverArm
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.report.diagnoses_by_hand import advice_on

VOID = {"meta", "line", "rect", "polyline", "br"}
SIX = 6


class Balanced(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.links = [], []

    def handle_starttag(self, tag, attrs):
        self.links += [v for k, v in attrs if k in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag


pytestmark = pytest.mark.slow  # all ask for one diagnosis


@pytest.fixture(scope="module")
def diagnosis():
    arm = GpsLeverArm(x=0.8, y=-0.5, z=-0.4)
    spec = FlightSpec(vehicle="copter", seed=3, duration=150.0, imus=random_imus(3), effects=(arm,))
    calibrator, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    return diagnose(calibrator, 1)


def test_the_concealed_effect_is_found_with_its_size(diagnosis):
    effects = {e.name: e for e in diagnosis.effects}
    assert "gps_lever_arm" in effects
    for axis, true in (("x", 0.8), ("y", -0.5), ("z", -0.4)):
        q = effects["gps_lever_arm"].unknowns[axis]
        assert abs(q.value - true) < max(3.0 * q.sigma, 0.1 * abs(true))
    assert set(effects) <= {"gps_lever_arm", "gps_latency", "gps_smoothing"}
    assert diagnosis.mismatch.held_out_after < diagnosis.mismatch.held_out_before


def document(diagnosis):
    return explain_document(
        diagnosis, files=["x.tlog"], autopilot="ardupilot", duration_s=1.0, samples={"imu": 1}
    ).to_json()


def test_the_document_has_only_finite_numbers(diagnosis):
    def refuse(text):
        pytest.fail(text)

    d = json.loads(document(diagnosis), parse_constant=refuse)
    assert d["schema"] == "onboard.explain/1"
    assert len(d["calibration"]["parameters"]) == SIX
    assert {"name", "unknowns", "share_of_mismatch", "delta_bic", "rivals"} <= set(d["effects"][0])


def test_the_page_is_well_formed_and_needs_nothing_else(diagnosis):
    page = explain_html(
        diagnosis,
        files=["<x>.tlog"],
        autopilot="ardupilot",
        duration_s=150.0,
        advice=advice_on(diagnosis),
    )
    parser = Balanced()
    parser.feed(page)
    assert parser.open == []
    assert parser.links == []
    assert "&lt;x&gt;.tlog" in page
    assert "GPS1_POS_X" in page


def test_what_is_not_a_number_does_no_harm(diagnosis):
    nan = float("nan")
    nothing = replace(
        diagnosis,
        verdict=Verdict.INSUFFICIENT,
        effects=(),
        mismatch=Mismatch(False, nan, nan, nan, nan, nan, nan, nan),
        series=Series(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool)),
        ladder=(),
    )
    parser = Balanced()
    parser.feed(explain_html(nothing, files=["x"], autopilot="px4", duration_s=nan, advice=None))
    assert parser.open == []
    json.loads(document(nothing))


def test_the_parameter_file_reads_back(diagnosis):
    lines = parameter_text(diagnosis, advice_on(diagnosis), ["x.tlog"]).splitlines()
    pairs = dict(line.split(",") for line in lines if not line.startswith("#"))
    seen = sum(diagnosis.calibration.observable)
    assert sum(name.startswith("INS_ACC") for name in pairs) == seen
    assert float(pairs["GPS1_POS_X"]) == pytest.approx(0.8, abs=0.1)


def test_held_out_errors_are_told_in_metres_per_second_too(diagnosis):
    d = json.loads(document(diagnosis))
    before, after = (d["mismatch"][f"held_out_velocity_rms_{x}_m_s"] for x in ("before", "after"))
    steps = [r["held_out_velocity_rms_m_s"] for r in d["ladder"]]
    assert steps[0] == before
    assert steps[-1] == after
    assert after < 0.5 * before
    # Predicting what was not fitted is never easier than fitting it, but for chance.
    assert after > 0.9 * d["mismatch"]["velocity_rms_after_m_s"]


def test_the_effect_follows_the_data_that_are_left_without_it(diagnosis):
    arm = next(e for e in diagnosis.effects if e.name == "gps_lever_arm")
    left, made = arm.imprint.left, arm.imprint.made
    assert np.nanstd(left - made) < 0.5 * np.nanstd(left)
    assert arm.held_out_velocity_after < arm.held_out_velocity_before
