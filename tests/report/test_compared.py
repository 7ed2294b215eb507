"""Accelerometers compared, as it is shown: in a terminal, on the page, and for other programs."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from onboard.answers.compared import remarks
from onboard.answers.recorded import Recorded, unanswered
from onboard.answers.replay import Replay, replay
from onboard.cli.table import replay_report
from onboard.core.estimate.common_cause import CommonChange
from onboard.core.estimate.comparison import Comparison, PairDifference
from onboard.core.estimate.joint import Joint
from onboard.recordings.recording import Recording
from onboard.report.replay import replay_html
from sitl import recording
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec
from tests.cli.results import CALIBRATED
from tests.report.html_page import Page

PAIR = PairDifference(
    imus=(1, 2),
    in_force=(0.49, -0.66, -0.03),
    estimated=(0.041, -0.052, 0.012),
    own=(0.0, 0.001, 0.0),
    own_sigma=(0.0021, 0.0019, 0.0034),
    chi_square=21.3,
    distance=(0.01, 0.0, -0.21),
    distance_sigma=(0.003, 0.003, 0.006),
    windows=311,
)
JOINT = Joint((1, 2), np.zeros((2, 6)), np.ones((2, 6)), np.eye(12))
COMPARISON = Comparison((PAIR,), JOINT, (CommonChange(0, -0.11, 0.01, 0.002),), 2, ())
FILE = Recording(Path("a.BIN"), "dataflash", "ardupilot", 311.0, {}, iter)
BOTH = tuple(map(unanswered, (CALIBRATED, replace(CALIBRATED, imu=2))))

TWO = (
    ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3)),
    ImuTruth(scale=(0.99, 1.01, 0.985), offset=(-0.2, 0.1, -0.1)),
)


def shown(comparison):
    result = Replay((FILE,), BOTH, {}, remarks(comparison), {}, comparison)
    console = Console(file=io.StringIO(), width=80)
    for part in replay_report(result):
        console.print(part)
    return console.file.getvalue(), json.loads(result.document().to_json())


def test_the_terminal_has_each_axis_of_each_pair():
    text, _ = shown(COMPARISON)
    assert max(map(len, text.splitlines())) <= 80
    row = next(line for line in text.splitlines() if line.strip().startswith("1 less 2, x"))
    assert row.split()[-5:] == ["0.490", "0.041", "0.000", "0.0021", "21.3"]
    words = " ".join(text.split())
    assert "both accelerometers ask for the same change of the x offset, -0.11 m/s^2" in words
    assert "tilted by 0.64 degrees" in words


def test_a_sensor_that_is_not_where_it_is_said_to_be_is_a_note():
    _, document = shown(COMPARISON)
    (note,) = [n for n in document["recording"]["notes"] if "INS_POS" in n]
    assert "-0.21 m in z" in note
    assert " in x" not in note


def test_one_that_all_others_see_elsewhere_is_named_alone():
    pairs = (
        replace(PAIR, distance=(0.0, 0.0, 0.0)),
        replace(PAIR, imus=(1, 3), distance=(0.0, 0.0, 0.23)),
        replace(PAIR, imus=(2, 3), distance=(0.0, 0.0, 0.25)),
    )
    joint = Joint((1, 2, 3), np.zeros((3, 6)), np.ones((3, 6)), np.eye(18))
    (note,) = remarks(Comparison(pairs, joint, (), 2, ()))
    assert note.startswith("accelerometer 3 is -0.24 m in z from where INS_POS3 has it")


def test_other_programs_get_pairs_cause_and_joint_numbers():
    _, document = shown(COMPARISON)
    found = document["accelerometers"]
    assert found["pairs"][0]["imus"] == [1, 2]
    assert found["pairs"][0]["own_sigma_m_s2"] == [0.0021, 0.0019, 0.0034]
    assert 0.0 < found["pairs"][0]["p_value"] < 1e-3
    assert [j["imu"] for j in found["joint"]] == [1, 2]
    assert len(found["common_cause"]) == 1


def test_what_cannot_be_compared_is_not_mentioned():
    text, document = shown(None)
    assert "compared" not in text
    assert "accelerometers" not in document
    assert remarks(None) == ()


@pytest.mark.slow
def test_two_accelerometers_of_a_simulated_flight(tmp_path):
    path = tmp_path / "two.tlog"
    recording.write_tlog(FlightSpec(vehicle="copter", duration=100.0, imus=TWO), path)
    recorded = Recorded(watched=True)
    result = replay([path], recorded)
    (pair,) = result.comparison.pairs
    assert np.all(np.abs(pair.estimated) < 0.2 * np.abs(pair.in_force) + 0.01)
    assert np.all(np.array(pair.own_sigma) < 0.02)
    assert pair.chi_square < 16.3
    found = result.comparison.joint
    for imu, truth in enumerate(TWO, start=1):
        value, covariance = found.of(imu)
        error = value - np.array([*truth.scale, *truth.offset])
        assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(covariance)))
    page = Page.of(replay_html(result, recorded.chronicle))
    assert "Accelerometers compared" in page.text
    assert "1 less 2, z" in page.text


@pytest.mark.slow
def test_what_one_says_is_what_it_says_without_the_other(tmp_path):
    """To what a search for noise is worth: the second one's begins where the first one's has ended.

    That is half of the log-likelihood, or a tenth of a sigma, in the median of some flights: of
    eight, five have a sigma that is more than 5 % another one, and two an estimate that is 0.14 and
    0.19 sigma away.
    """
    apart, wider = [], []
    for seed in range(3):
        path = tmp_path / f"{seed}.tlog"
        spec = FlightSpec(vehicle="copter", duration=100.0, imus=TWO, seed=seed)
        recording.write_tlog(spec, path)
        together = replay([path], Recorded()).calibrations[1]
        alone = replay([path], Recorded((2,)), imu=2)
        assert alone.comparison is None
        (one,) = alone.calibrations
        sigma = np.sqrt(np.diag(one.covariance))
        moved = np.subtract([*together.scale, *together.offset], [*one.scale, *one.offset])
        apart.append(np.abs(moved / sigma).max())
        wider.append(np.abs(np.sqrt(np.diag(together.covariance)) / sigma - 1.0).max())
    assert np.median(apart) < 0.1
    assert np.max(apart) < 0.5
    assert np.median(wider) < 0.1
