"""What is kept of flights over boots: only what was judged, once each, and of one sensor."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from onboard.core.estimate.saving import load
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import ParameterValue
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.store import Store
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

pytestmark = pytest.mark.slow

OURS = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SHAKEN = replace(OURS, offset=(0.2, -0.15, 0.6))
"""After a hard landing that nobody has told of."""
BOARD, SILENT = Identity(1, board="0a0b0c"), Identity(1)


def flown(imu, seed):
    decoder, out = Decoder(1, 1), []
    spec = FlightSpec(vehicle="copter", duration=110.0, imus=(imu,), seed=seed, loop_rate=200)
    for _, message in fly_messages(spec):
        out += decoder.decode(message)
    return sorted(out, key=lambda s: not isinstance(s, ParameterValue))


@pytest.fixture(scope="module")
def first():
    return flown(OURS, 1)


@pytest.fixture(scope="module")
def second():
    return flown(OURS, 2)


def told(flight, **values):
    its = {s.name: s.value for s in flight if isinstance(s, ParameterValue)} | values
    return [ParameterValue(name, value) for name, value in its.items()]


def learner(directory, flight, whose=BOARD):
    made = Learner(Store(directory), CalibratorSettings(), clock=float, wall_clock=float)
    made.identify(whose, told(flight))
    return made


def fly(made, flight, *, judge=True):
    learned = made.learn(flight, judging=())
    while judge and learned.diagnosing:
        learned = made.examine()
    return learned


def reboot(made, flight, whose=BOARD, **values):
    made.gap()
    made.identify(whose, told(flight, **values))


def off(calibration, imu):
    six = np.array(calibration.scale + calibration.offset) - np.array(imu.scale + imu.offset)
    return six / np.array(calibration.scale_sigma + calibration.offset_sigma)


def on_disk(directory):
    saved = Store(directory).load(1, BOARD.board)
    return load(saved.sums)


def test_flights_that_agree_are_added_and_each_of_them_once(tmp_path, first, second):
    """Also where the board does not say at each boot which it is."""
    made = learner(tmp_path, first)
    alone = fly(made, first).calibrations[1]
    made.save(1.0)
    for whose in (SILENT, BOARD, SILENT, BOARD):
        reboot(made, first, whose)
        made.save(1.0)
    fly(made, second)
    together = made._calibrator.calibration(1)
    assert together.rejected["restored"] == 1
    assert 1.7 * alone.trusted_s < together.trusted_s < 2.3 * alone.trusted_s
    assert np.max(np.abs(off(together, OURS))) < 3.5
    assert len(set(on_disk(tmp_path)[0].flights)) == 1
    made.save(1.0)
    assert len(set(on_disk(tmp_path)[0].flights)) == 2


def test_a_sensor_that_has_changed_between_two_boots_is_not_averaged(tmp_path, first):
    made = learner(tmp_path, first)
    fly(made, first)
    reboot(made, first)
    found = fly(made, flown(SHAKEN, 2)).calibrations[1]
    assert found.offset[2] == pytest.approx(0.6, abs=0.1)
    assert np.max(np.abs(off(found, SHAKEN))) < 3.5
    assert made._calibrator.calibration(1).rejected["saved_contradicted"] == 1


def test_another_sensor_with_the_same_values_in_force_gets_nothing_of_the_one_before(
    tmp_path, first
):
    """Its identifier says so: ArduPilot's slot keeps its six."""
    made = learner(tmp_path, first)
    assert fly(made, first).flight.current
    reboot(made, first, INS_ACC_ID=4711.0)
    learned = made.learn([], judging=())
    assert learned.flight is None
    assert learned.calibrations == {}
    made.learn(told(first, INS_ACC_ID=4712.0), judging=())
    assert made._calibrator.imus == ()


def test_a_sensor_that_a_boot_has_not_found_is_as_it_was_when_the_next_one_finds_it(
    tmp_path, first
):
    """ArduPilot sets the identifier of an empty slot to zero; that names no other sensor."""
    made = learner(tmp_path, first)
    found = fly(made, first).flight.diagnosed[1].calibration
    reboot(made, first, INS_ACC_ID=0.0)
    learned = made.learn([], judging=())
    assert learned.flight is None, "nothing is proposed for a slot in which none is named"
    assert learned.calibrations == {}
    made.save(1.0)
    reboot(made, first)
    learned = made.learn([], judging=())
    assert not learned.flight.current
    assert learned.flight.diagnosed[1].calibration.offset == found.offset
    assert learner(tmp_path, first).learn([], judging=()).flight is not None


def test_what_was_not_judged_is_not_kept(tmp_path, first):
    """The power goes at the landing: nobody can say any more whether physics was missing."""
    made = learner(tmp_path, first)
    fly(made, first, judge=False)
    made.save(1.0)
    assert on_disk(tmp_path) == []
    learned = made.examine()
    assert not learned.diagnosing
    made.save(1.0)
    assert [its.imu for its in on_disk(tmp_path)] == [1]


def test_a_boot_of_the_same_board_with_the_same_sensors_takes_nothing_back(tmp_path, first):
    made = learner(tmp_path, first)
    fly(made, first, judge=False)
    reboot(made, first)
    learned = made.learn([], judging=())
    assert learned.diagnosing, "a flight is judged though the power goes right after the landing"
    learned = made.examine()
    assert learned.flight.current
    assert made._calibrator.waiting == ()  # the clock has not begun anew yet
    made.save(1.0)
    assert len(on_disk(tmp_path)) == 1


def test_sums_of_another_version_can_still_be_looked_at(tmp_path, first):
    made = learner(tmp_path, first)
    fly(made, first)
    made.save(1.0)
    store = Store(tmp_path)
    saved = store.load(1, BOARD.board)
    older = saved.sums.replace(b'"version": ', b'"version": 1')
    store.save(1, older, version="", saved_at=1.0, board=BOARD.board, flight=saved.flight)
    again = learner(tmp_path, first)
    assert any("set aside as" in news.text for news in again.learn([], judging=()).news)
    again.save(2.0)
    (aside,) = tmp_path.glob("*.refused")
    assert msgspec.msgpack.decode(aside.read_bytes())["sums"] == older


def test_a_sensor_that_has_changed_between_two_flights_of_one_boot_has_not_jumped_in_flight(
    tmp_path, first
):
    """What the last flight shows is what counts, and nothing is said to be missing."""
    made = learner(tmp_path, first)
    assert fly(made, first).flight.current
    later = [replace(s, t=s.t + 400.0) if s.t is not None else s for s in flown(SHAKEN, 2)]
    learned = fly(made, later)
    found = learned.flight.diagnosed[1]
    assert (found.missing, "bias_step" in found.effects) == ("", False)
    assert learned.flight.current
    assert found.calibration.offset[2] == pytest.approx(0.6, abs=0.1)
    assert np.max(np.abs(off(found.calibration, SHAKEN))) < 3.5
    assert any("between two flights" in news.text for news in learned.news)
    made.save(1.0)
    assert on_disk(tmp_path) == []
