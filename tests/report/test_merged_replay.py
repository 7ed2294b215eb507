"""Several recordings of one vehicle: each keeps its own noise and timing, contradictions show."""

from __future__ import annotations

import io
import itertools
import json
import os

import numpy as np
import pytest
from rich.console import Console

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.answers.flights import Flights, distinct
from onboard.answers.recorded import Recorded
from onboard.answers.replay import replay
from onboard.batches.job import Job, done
from onboard.cli.table import replay_report
from onboard.core.estimate.result import Status
from onboard.report.replay import replay_html
from sitl import recording
from sitl.builtin.effects.accelerometer import CrossAxis
from sitl.builtin.effects.accelerometer_hysteresis import AccelerometerHysteresis
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec
from tests.recordings.dated import flown
from tests.report.html_page import Page

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
BUMPED = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.45, -0.2, 0.3))
SIX = np.array([*TRUE.scale, *TRUE.offset])
QUIET = GpsTruth(delay=0.10)
LOUD = GpsTruth(delay=0.24, velocity_noise=0.15)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    specs = {
        "monday": FlightSpec(vehicle="copter", seed=1, duration=110.0, imus=(TRUE,), gps=QUIET),
        "tuesday": FlightSpec(vehicle="copter", seed=2, duration=110.0, imus=(TRUE,), gps=LOUD),
        "bumped": FlightSpec(vehicle="copter", seed=3, duration=110.0, imus=(BUMPED,), gps=QUIET),
        "hover": FlightSpec(vehicle="copter", seed=5, duration=75.0, imus=(TRUE,), dull=True),
        "hop": FlightSpec(vehicle="copter", seed=4, duration=32.0, imus=(TRUE,), dull=True),
    }
    out = {}
    for name, spec in specs.items():
        out[name] = folder / f"{name}.tlog"
        recording.write_tlog(spec, out[name])
    return out


def together(files, *names):
    paths = [files[name] for name in names]
    flights = Flights(distinct(paths), watched=True)
    return replay(paths, flights), flights


def printed(result):
    console = Console(file=io.StringIO(), width=80)
    for part in replay_report(result):
        console.print(part)
    return console.file.getvalue()


@pytest.fixture(scope="module")
def agreeing(files):
    return together(files, "monday", "tuesday", "hover", "hop")


@pytest.fixture(scope="module")
def contradicting(files):
    return together(files, "monday", "bumped")


def test_flights_that_agree_are_one_answer_and_keep_their_own_timing(agreeing):
    result, _ = agreeing
    (answer,) = result.answers
    c = answer.calibration
    assert c.status is Status.CALIBRATED
    sigma = np.array(c.scale_sigma + c.offset_sigma)
    assert np.all(np.abs(np.array(c.scale + c.offset) - SIX) < 4.0 * sigma)
    monday, tuesday, hover, hop = answer.flights
    assert [f.counted for f in answer.flights] == [True, True, True, False]
    assert hover.why == ""
    assert hop.why.endswith("s of trusted GPS only")
    own = [np.array(f.given.calibration.offset_sigma) for f in (monday, tuesday)]
    assert np.all(np.array(c.offset_sigma) < 1.2 * np.minimum(*own))
    delays = [f.given.calibration.timing["gps_delay_s"].value for f in (monday, tuesday)]
    assert delays[1] - delays[0] == pytest.approx(0.14, abs=0.03)
    assert c.timing == {}
    assert monday.apart.dof > 0
    assert not monday.apart.contradicted
    assert c.trusted_s == sum(f.given.calibration.trusted_s for f in (monday, tuesday, hover))


def test_a_flight_says_what_it_says_alone(files, agreeing):
    alone = replay([files["monday"]], Recorded()).calibrations[0]
    own = agreeing[0].answers[0].flights[0].given.calibration
    assert own.scale + own.offset == alone.scale + alone.offset
    assert own.covariance == alone.covariance
    assert own.timing == alone.timing


def test_flights_that_contradict_each_other_are_named_and_not_averaged(contradicting):
    result, _ = contradicting
    (answer,) = result.answers
    c = answer.calibration
    assert c.status is Status.INSUFFICIENT
    assert not np.any(np.isfinite(c.scale + c.offset))
    for name in ("monday.tlog", "bumped.tlog"):
        assert name in c.note
    assert all(f.contradicted and f.apart.contradicted for f in answer.flights)
    (advice,) = result.advice
    assert not advice.settable


@pytest.mark.parametrize("which", ["agreeing", "contradicting"])
def test_every_outlet_tells_flight_by_flight(which, request):
    result, flights = request.getfixturevalue(which)
    document = json.loads(result.document().to_json())
    assert [f["file"] for f in document["flights"]] == [str(r.path) for r in result.recordings]
    for entry, flight in zip(document["flights"], result.answers[0].flights, strict=True):
        (imu,) = entry["imus"]
        assert imu["contradicted"] == flight.contradicted
        assert imu["counted"] == flight.counted
        assert flight.why or imu["scale"] == list(flight.given.calibration.scale)
    text = printed(result)
    assert max(map(len, text.splitlines())) <= 80
    assert "nan" not in text
    page = Page.of(replay_html(result, flights.chronicle))
    assert "Flight by flight" in page.words
    for name in ("monday.tlog", "contradicts" if which == "contradicting" else "counts"):
        assert name in text
        assert name in page.words


def test_one_after_the_other_on_one_axis(agreeing):
    result, flights = agreeing
    chronicle = flights.chronicle
    course = chronicle.figures(1).course
    assert np.all(np.diff(course.t) >= 0.0)
    assert chronicle.duration_s > result.duration_s - 3.0
    spans = chronicle.spans
    assert all(a.end <= b.start for a, b in itertools.pairwise(spans))


def test_a_single_recording_has_no_flights(files):
    document = json.loads(replay([files["hop"]], Recorded()).document().to_json())
    assert "flights" not in document


def test_names_tell_files_apart():
    assert distinct(["a/x.BIN", "b/y.BIN"]) == ("x.BIN", "y.BIN")
    assert distinct(["a/x.BIN", "b/x.BIN"]) == ("a/x.BIN", "b/x.BIN")


def test_what_no_flight_shows_and_all_have_is_in_the_sigmas(tmp_path):
    """A loop of 0.03 m/s^2: the y scale of the mean of six planes was 4.2 sigma off."""
    loop = AccelerometerHysteresis(x=0.03, y=0.03, z=0.03)
    paths = []
    for seed in range(500, 506):
        spec = FlightSpec(
            vehicle="plane",
            seed=seed,
            duration=100.0,
            imus=(TRUE,),
            gps=GpsTruth(delay=0.14),
            effects=(loop,),
        )
        paths.append(tmp_path / f"{seed}.tlog")
        recording.write_tlog(spec, paths[-1])
    (answer,) = replay(paths, Flights(distinct(paths))).answers
    assert all(f.counted for f in answer.flights)
    names = [e.name for f in answer.flights for e in f.given.diagnosis.effects]
    assert "accelerometer_hysteresis" not in names
    c = answer.calibration
    off = np.abs(np.array(c.scale + c.offset) - SIX)
    assert np.all(off < 3.0 * np.array(c.sigma_with_its_gyroscope))
    assert "The flights together leave open whether" in c.note
    assert "(accelerometer_hysteresis)" in c.note


def test_a_fleet_says_of_the_same_flights_what_their_replay_says(tmp_path):
    """One way of merging, and what a record keeps of a flight is all that it takes."""
    leak = CrossAxis(zx=0.006, xz=0.006)
    paths = [
        flown(
            FlightSpec(seed=30 + k, duration=110.0, imus=(TRUE,), loop_rate=200, effects=(leak,)),
            tmp_path / f"{k}.tlog",
            k,
        )
        for k in range(2)
    ]
    (answer,) = replay(paths, Flights(distinct(paths))).answers
    every = [Flown(path, path.name, done(Job(path=os.fsencode(path))).record) for path in paths]
    (vehicle,) = vehicles_of(every, by_folder=True)
    (heard,) = history_of(vehicle).accelerometers
    c, m = answer.calibration, heard.merged
    assert len(m.counted) == sum(f.counted for f in answer.flights) == 2
    assert list(m.value) == pytest.approx(c.scale + c.offset, rel=1e-9)
    assert list(m.sigma) == pytest.approx(c.scale_sigma + c.offset_sigma, rel=1e-9)
    assert m.open in c.note
