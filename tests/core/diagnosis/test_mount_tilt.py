"""One story of a tilt: which of the sensors is turned, what helps, and nothing more after it."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.diagnosis.procedure import diagnose
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.mount_tilt import TRIM_RAD, MountTilt, attitude_cure, levelled
from onboard.mavlink.decode import Decoder
from sitl.builtin import effects as fx
from sitl.builtin import rotation
from sitl.builtin.messages import packed
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec, run

TURNED = fx.AccelerometerTilt(roll=-0.03, pitch=0.025)
ASKEW = fx.BoardTilt(roll=0.03, pitch=-0.025)
OF_BOARD = {"AHRS_TRIM_X": 0.03, "AHRS_TRIM_Y": -0.025}
MISTAKEN = {"AHRS_TRIM_X": -0.03, "AHRS_TRIM_Y": 0.024}


def spec(*effects, **parameters):
    return FlightSpec(
        vehicle="copter",
        duration=110.0,
        seed=3,
        imus=(ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3)),),
        gps=GpsTruth(delay=0.04),
        effects=effects,
        parameters=parameters,
    )


def diagnosed(flown):
    decoder, packer = Decoder(system=1, component=1), mavlink.MAVLink(None, 1, 1)
    made = Calibrator(CalibratorSettings(buffer_s=3600.0, refine=False))
    for _, message in flight_of(flown).messages:
        packed(message, packer)  # which gives it its header
        for sample in decoder.decode(message):
            made.feed(sample)
    made.finish()
    return diagnose(made, 1)


FLIGHTS = {}


@pytest.fixture(scope="module", autouse=True)
def _forgotten():
    """Flights are long: they go when they have been asked."""
    yield
    FLIGHTS.clear()


def flight_of(flown):
    """The flight, flown once for its diagnosis and for all that ask for its attitude."""
    return FLIGHTS.get(repr(flown)) or FLIGHTS.setdefault(repr(flown), run(flown))


def attitude_error(flown):
    """Mean of roll and pitch as reported, less the airframe's own, rad; late in the flight."""
    flight = flight_of(flown)
    flying = flight.pieces[-1]
    off = []
    for _, message in flight.messages:
        t = getattr(message, "time_boot_ms", 0) * 1e-3
        if message.get_type() == "ATTITUDE" and 55.0 < t < 105.0:
            true = rotation.one_to_euler(flying.trajectory.R_nb[flying.index(t)])
            off.append([message.roll - true[0], message.pitch - true[1]])
    return np.mean(off, axis=0)


def tilts(diagnosis):
    return [e for e in diagnosis.effects if e.name == "mount_tilt"]


@pytest.mark.slow
def test_an_accelerometer_turned_against_its_gyroscope_is_no_reason_for_a_trim():
    flown = spec(TURNED)
    (tilt,) = tilts(diagnosed(flown))
    for key, true in (("roll", TURNED.roll), ("pitch", TURNED.pitch)):
        assert abs(tilt.unknowns[key].value - true) < max(0.1 * abs(true), 3 * 0.0015)
    assert tilt.parameters == {}
    assert "leave AHRS_TRIM" in tilt.cure
    assert "no parameter" in tilt.cure
    # And it is so: the reported attitude is right, and a trim would turn it.
    assert np.abs(attitude_error(flown)).max() < 0.01
    assert np.abs(attitude_error(spec(TURNED, **MISTAKEN))).max() > 0.02


@pytest.mark.slow
def test_a_trim_that_was_set_for_the_accelerometers_tilt_is_taken_back():
    flown = spec(TURNED, **MISTAKEN)
    (tilt,) = tilts(diagnosed(flown))  # one story, not two of opposite sign
    assert tilt.unknowns["roll"].value == pytest.approx(TURNED.roll, abs=0.005)
    assert tilt.parameters == {"AHRS_TRIM_X": 0.0, "AHRS_TRIM_Y": 0.0}
    assert np.abs(attitude_error(flown)).max() > 0.02
    assert np.abs(attitude_error(spec(TURNED, **tilt.parameters))).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "trim"),
    [((ASKEW,), OF_BOARD), ((), MISTAKEN)],
    ids=["as the board sits", "anyhow"],
)
def test_a_trim_says_nothing_of_what_is_missing(effects, trim):
    """Board against airframe: no flight shows it, and what holds it is no effect."""
    said = diagnosed(spec(*effects, **trim))
    assert said.effects == ()
    assert "AHRS_TRIM" in said.note
    if effects:
        assert np.abs(attitude_error(spec(*effects, **trim))).max() < 0.01


@pytest.mark.slow
def test_an_attitude_off_against_both_sensors_is_trimmed_and_then_clean():
    flown = spec(fx.MountTilt(roll=0.03, pitch=-0.025))
    (tilt,) = tilts(diagnosed(flown))
    assert tilt.unknowns["roll"].value == pytest.approx(0.03, abs=0.005)
    cured = spec(*flown.effects, **tilt.parameters)
    assert np.abs(attitude_error(flown)).max() > 0.02
    assert np.abs(attitude_error(cured)).max() < 0.01
    assert tilts(diagnosed(cured)) == []


# What is advised, by the numbers alone.

STRAIGHT = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def told(**values):
    made = ParametersInForce()
    for name, value in ({"AHRS_TRIM_X": 0.0, "AHRS_TRIM_Y": 0.0} | values).items():
        made.set(name, value)
    return made


def test_a_trim_of_another_size_is_the_boards_unless_it_was_levelled():
    made = MountTilt(Origin(0.0, trim=(0.05, 0.02, 0.0)))
    cure = made.cured({"roll": -0.03, "pitch": 0.0})
    assert cure.parameters == {}
    assert "X 0.020, Y 0.020" in cure.words
    near = MountTilt(Origin(0.0, trim=(0.03 + 0.5 * TRIM_RAD, 0.0, 0.0)))
    assert near.cured({"roll": -0.03, "pitch": 0.0}).parameters == {
        "AHRS_TRIM_X": 0.0,
        "AHRS_TRIM_Y": 0.0,
    }
    second = MountTilt(Origin(0.0, trim=(0.03, 0.0, 0.0), imu=2))  # not what was levelled with
    assert second.cured({"roll": -0.03, "pitch": 0.0}).parameters == {}


def test_what_arducopter_levels_to_is_what_levelled_says():
    """An accelerometer that reads 0.3 m/s^2 too much forward seems pitched up at level."""
    six = STRAIGHT.copy()
    six[3] = -0.3  # f = raw - 0.3, and nothing of it in force
    assert levelled(six, told(), 1) == pytest.approx([0.0, 0.3 / 9.80665], abs=1e-9)
    # As _calculate_trim has it: x = atan2(-f_y, -f_z).
    six = STRAIGHT.copy()
    six[4] = -0.3
    assert levelled(six, told(), 1) == pytest.approx([-0.3 / 9.80665, 0.0], abs=1e-9)


def test_an_attitude_levelled_with_a_wrong_offset_wants_the_calibration_not_a_trim():
    six = STRAIGHT.copy()
    six[3] = -0.3
    cure = attitude_cure(np.array([0.0, 0.03]), six, told(), 1)
    assert "set the calibration" in cure.words
    assert cure.parameters == {}


@pytest.mark.parametrize(
    ("parameters", "imu", "words"),
    [
        (told(), 2, "another board's"),
        (ParametersInForce(), 1, "nothing, if AHRS_TRIM is X -0.030, Y 0.000"),
        (told(AHRS_TRIM_X=0.02), 1, "X 0.050, Y 0.000 in all"),
    ],
    ids=["another board", "no parameters", "a trim already"],
)
def test_what_is_conditional_is_said_and_not_set(parameters, imu, words):
    cure = attitude_cure(np.array([0.03, 0.0]), STRAIGHT, parameters, imu)
    assert words in cure.words
    assert cure.parameters == {}
