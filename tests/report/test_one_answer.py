"""Whoever is asked about a flight gives the same numbers, sigmas and status."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from onboard.answers.answer import answer
from onboard.answers.explain import explain
from onboard.answers.recorded import Recorded
from onboard.answers.replay import read
from onboard.cli.main import run
from onboard.core.estimate.result import Status
from sitl.builtin import effects
from sitl.recording import FlightSpec, write_tlog
from tests.explained import explained, replayed
from tests.report.test_answer import TRUE, off

OTHER = type(TRUE)(scale=(0.99, 1.01, 0.985), offset=(-0.1, 0.15, 0.2))
HIDDEN = {
    "nothing": (),
    "jump": (effects.BiasStep(time=50.0, x=0.4, y=-0.3, z=0.3),),
}


@pytest.fixture(params=HIDDEN, scope="module")
def flight(request, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp(request.param) / "flight.tlog"
    spec = FlightSpec(
        vehicle="plane",
        duration=130.0,
        imus=(TRUE, OTHER),
        effects=HIDDEN[request.param],
        rates={"RAW_IMU": 25.0, "ATTITUDE": 25.0},
        seed=3,
    )
    write_tlog(spec, path)
    return path


@pytest.mark.slow
def test_replay_explain_and_the_service_answer_alike(flight, request):
    """The second accelerometer, read with the first and without it: right numbers, or none."""
    recorded = Recorded()
    read([flight], recorded)
    theirs, ours = recorded.answer(2), explain([flight], imu=2).answer
    if request.node.callspec.params["flight"] == "nothing":
        assert theirs.calibration.status is Status.CALIBRATED
        assert theirs.missing == ""
        assert off(theirs.calibration, OTHER).max() < 4.0
    else:
        assert theirs.calibration.status is Status.INSUFFICIENT
        assert theirs.missing
    # Frozen records: equal in every number, sigma, status and word.
    assert ours.calibration == theirs.calibration
    assert ours.missing == theirs.missing
    assert ours.diagnosis.verdict is theirs.diagnosis.verdict
    # A service counts time from the flight's first sample, which shifts what is tried on the way.
    asked = answer(recorded.calibrator, 2, latest=True)
    assert asked.calibration.status is ours.calibration.status
    assert asked.diagnosis.verdict is ours.diagnosis.verdict
    assert [e.name for e in asked.diagnosis.effects] == [e.name for e in ours.diagnosis.effects]
    for name in ("scale", "offset"):
        sigma = np.array(getattr(ours.calibration, f"{name}_sigma"))
        there = np.array(getattr(asked.calibration, name))
        assert np.max(np.abs(there - getattr(ours.calibration, name)) / sigma) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("flight", ["jump"], indirect=True)
def test_the_documents_say_the_same(flight, capsys):
    assert run(["replay", str(flight), "--imu", "1", "--json", "-"]) == 0
    (replayed,) = json.loads(capsys.readouterr().out)["imus"]
    assert run(["explain", str(flight), "--json", "-"]) == 0
    explained = json.loads(capsys.readouterr().out)
    assert replayed["calibration"] == explained["calibration"]
    assert replayed["status"] == explained["calibration"]["status"]
    assert replayed["timing"] == explained["timing"]
    assert replayed["advice"]["conditions"] == explained["advice"]["conditions"] != {}
    assert not any(name.startswith("INS_") for name in explained["advice"]["set"])
    assert "physics_missing" in replayed["advice"]["held_back"]


RECORDINGS = ("sitl/c01.BIN", "real/real-fixedwing-02.BIN")  # streams are simulated, above


@pytest.mark.recordings
@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_have_one_answer(recordings, name):
    """By itself; what others add to it a replay, which has asked them, knows more of."""
    theirs = replayed(recordings / name).answers[0]
    ours = explained(recordings / name).answer
    alone = replace(theirs.calibration, together=None)
    assert repr(ours.calibration) == repr(alone)  # what is no number is equal, too
