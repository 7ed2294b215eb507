"""The calibrator on simulated flights: right numbers, whatever the stream does to itself."""

import dataclasses

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.events import Restarted
from onboard.core.estimate.gyro_axes import gyro_sigma
from onboard.core.estimate.limits import GYRO_CROSS_SIGMA
from onboard.core.estimate.result import Status
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ImuSource, ParameterValue
from onboard.core.inputs.tracks import untruncated
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.errors import StateError
from onboard.mavlink.decode import Decoder
from sitl import recording
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
RATES = {"VFR_HUD": 0, "VIBRATION": 0, "BATTERY_STATUS": 0, "GLOBAL_POSITION_INT": 0}
MOVED = {"scale": (0.98, 1.01, 1.03), "offset": (-0.1, 0.2, 0.4)}


def flown(vehicle, duration, *, imu=TRUE, rates=RATES, **more):
    spec = FlightSpec(vehicle=vehicle, duration=duration, imus=(imu,), rates=rates, **more)
    decoder = Decoder(system=1, component=1)
    samples = [s for _, m in recording.fly_messages(spec) for s in decoder.decode(m)]
    return samples, recording.truth_record(spec)["net_gps_delay_s"]


def fed(samples, made=None):
    made = made or Calibrator()
    for sample in samples:
        made.feed(sample)
    made.finish()
    return made


def calibrated(samples):
    return fed(samples).calibration(1)


def time_of(sample):
    return getattr(sample, "t", None)


def split(samples, t):
    """Samples before and after a moment; those without a time stay where they are."""
    at = next(i for i, s in enumerate(samples) if isinstance(s, ImuSample) and s.t >= t)
    return samples[:at], samples[at:]


def parameters_of(samples):
    return [s for s in samples if isinstance(s, ParameterValue)]


def assert_true(got, scale_limit=0.01, offset_limit=0.05):
    error = np.abs(np.array(got.scale + got.offset) - np.array(TRUE.scale + TRUE.offset))
    # The simulated gyroscope has the accelerometer's axes.
    sigma = got.sigma_with_its_gyroscope
    assert np.all(error < 4.0 * sigma), (error, sigma)
    # A number that the flight does not show says so; its sigma, above, has to cover its error.
    seen = np.array(got.observable)
    assert seen.sum() >= 4
    assert np.all((error < np.repeat([scale_limit, offset_limit], 3))[seen]), (error, sigma)


def assert_same(a, b, tolerance=0.0):
    for name in ("scale", "offset", "scale_sigma", "offset_sigma"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=tolerance)
    assert a.status is b.status


@pytest.fixture(scope="module")
def copter_flight():
    return flown("copter", 130.0)


@pytest.fixture(scope="module")
def copter(copter_flight):
    return copter_flight[0]


@pytest.fixture(scope="module")
def of_copter(copter):
    return calibrated(copter)


@pytest.fixture(scope="module", params=["copter", "plane"])
def long(request):
    """The calibration of a flight, and how late its GPS is."""
    if request.param == "copter":
        delay = request.getfixturevalue("copter_flight")[1]
        return request.getfixturevalue("of_copter"), delay
    samples, delay = flown("plane", 100.0)
    return calibrated(samples), delay


@pytest.fixture(scope="module")
def short(copter):
    """The first of it: enough for what must not change a bit."""
    return split(copter, 50.0)[0]


@pytest.fixture(scope="module")
def of_short(short):
    return calibrated(short)


@pytest.mark.slow
def test_the_truth_comes_out(long):
    got, delay = long
    assert got.status is Status.CALIBRATED
    assert_true(got)
    told = got.timing["gps_delay_s"]
    assert abs(told.value - delay) < max(0.005, 4.0 * told.sigma)
    assert got.whitened_rms_after < got.whitened_rms_before
    assert got.held_out_after < got.held_out_before


@pytest.mark.slow
def test_a_gyroscope_that_is_turned_is_taken_for_an_offset_and_covered(of_copter):
    e = np.array([0.005, -0.004, 0.0])
    imu = dataclasses.replace(TRUE, gyro_turn=tuple(e))
    got = calibrated(flown("copter", 130.0, imu=imu)[0])
    shift = np.array(got.offset) - np.array(of_copter.offset)
    # The gyroscope's axes, turned by e, see gravity turned by -e: e x (0, 0, -g).
    by = np.cross(e, [0.0, 0.0, -STANDARD_GRAVITY])
    np.testing.assert_allclose(shift[:2], by[:2], atol=0.1 * np.abs(by).max())
    sigma = got.sigma_with_its_gyroscope[3:]
    assert np.all(np.abs(shift[:2]) > 5.0 * sigma[:2])
    assert np.all(np.abs(shift) < 2.0 * np.array(got.offset_sigma))


def test_which_offsets_a_gyroscope_enters_depends_on_how_the_board_is_mounted():
    level = STANDARD_GRAVITY * GYRO_CROSS_SIGMA
    np.testing.assert_array_equal(gyro_sigma(np.eye(3)), [0, 0, 0, level, level, 0])
    on_its_side = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    np.testing.assert_array_equal(gyro_sigma(on_its_side), [0, 0, 0, level, 0, level])


@pytest.mark.slow
def test_a_heading_that_an_alignment_in_flight_puts_right_does_no_harm(copter, of_copter):
    """An EKF that took off with its compass 40 degrees off, aligned some seconds later."""
    off = np.deg2rad(40.0)
    first = next(s.t for s in copter if isinstance(s, GpsFix) and np.hypot(s.v_n, s.v_e) > 1.0)
    turned = [
        dataclasses.replace(s, yaw=s.yaw + off * min(1.0, np.exp(-(s.t - first - 8.0) / 4.0)))
        if isinstance(s, AttitudeSample)
        else s
        for s in copter
    ]
    got = calibrated(turned)
    assert_true(got)
    sigma = of_copter.sigma_with_its_gyroscope
    change = np.array(got.scale + got.offset) - np.array(of_copter.scale + of_copter.offset)
    assert np.all(np.abs(change) < 2.0 * sigma)
    assert got.rejected.get("heading_set_anew", 0) > 0
    assert got.rejected.get("innovation", 0) == of_copter.rejected.get("innovation", 0)


ANTENNA = (0.6, -0.2, -0.4)
PLACES = {
    "antenna": {f"GPS1_POS_{a}": x for a, x in zip("XYZ", ANTENNA, strict=True)},
    "accelerometer": {f"INS_POS1_{a}": -x for a, x in zip("XYZ", ANTENNA, strict=True)},
    "untold": {},
}


@pytest.fixture(scope="module")
def long_armed():
    """A flight with its antenna far from the accelerometer, the autopilot's parameters left out."""
    samples, _ = flown("copter", 120.0, gps=GpsTruth(antenna=ANTENNA))
    return [s for s in samples if not (isinstance(s, ParameterValue) and "_POS" in s.name)]


@pytest.mark.slow
@pytest.mark.parametrize("told", PLACES)
def test_an_antenna_whose_place_is_told_does_no_harm(long_armed, told):
    """The receiver reports its antenna's velocity; nobody but the estimator moves it."""
    places = [ParameterValue(name, x) for name, x in PLACES[told].items()]
    made = fed([*places, *long_armed])
    engine = made.engine(1)
    first = engine.model.index["antenna_x"]
    left = engine.solution().theta[first : first + 3]
    if told == "untold":
        # What is not told is left for the prior of a few centimetres to allow.
        np.testing.assert_allclose(left, ANTENNA, atol=0.1)
    else:
        assert_true(made.calibration(1))
        assert np.max(np.abs(left)) < 0.02


def test_the_antenna_is_found_by_its_old_name_too():
    old, new = ParametersInForce(), ParametersInForce()
    for axis, x in zip("XYZ", ANTENNA, strict=True):
        old.set(f"GPS_POS1_{axis}", x)
        new.set(f"GPS1_POS_{axis}", x)
    assert old.antenna == pytest.approx(ANTENNA)
    assert old.antenna == pytest.approx(new.antenna)


@pytest.mark.slow
def test_an_antenna_told_a_little_wrong_does_no_harm(long_armed):
    """Nobody measures it to a centimetre, and nothing else may pay for that."""
    off = [x + 0.03 for x in ANTENNA]
    told = [ParameterValue(f"GPS1_POS_{a}", x) for a, x in zip("XYZ", off, strict=True)]
    got = calibrated([*told, *long_armed])
    error = np.abs(np.array(got.scale + got.offset) - np.array(TRUE.scale + TRUE.offset))
    assert np.all(error <= 3.0 * np.array(got.scale_sigma + got.offset_sigma))
    assert_true(got)


@pytest.mark.slow
def test_a_sparse_attitude_is_not_interpolated():
    """At 4 Hz a copter tips over and back between two samples."""
    samples, delay = flown("copter", 120.0, rates=RATES | {"ATTITUDE": 4.0}, seed=7)
    got = calibrated(samples)
    assert_true(got)
    told = got.timing["gps_delay_s"]
    assert abs(told.value - delay) < 3.0 * told.sigma


@pytest.mark.slow
def test_repeated_and_late_samples_change_nothing(short, of_short):
    noisy, recent = [], []
    for sample in short:
        noisy.append(sample)
        if isinstance(sample, ImuSample | AttitudeSample | GpsFix):
            noisy.append(sample)
            recent.append(sample)
            if len(recent) > 9 and time_of(recent[-9]) < sample.t:
                noisy.append(recent[-9])
    got = calibrated(noisy)
    assert_same(got, of_short)
    assert got.rejected["imu_repeated"] > 1000
    assert got.rejected["imu_late"] > 100


def exact(sample):
    """Truncation undone, so that other parameters may be applied without another truncation."""
    if not isinstance(sample, ImuSample):
        return sample
    f = untruncated(np.array(sample.f_b), sample.f_step)
    return dataclasses.replace(sample, f_b=tuple(f.tolist()), f_step=0.0)


@pytest.mark.slow
def test_a_change_of_parameters_in_flight_leaves_the_estimate(short):
    before, after = split([exact(s) for s in short], 30.0)
    in_force = {p.name: p.value for p in parameters_of(short)}
    s0 = np.array([in_force[f"INS_ACCSCAL_{a}"] for a in "XYZ"])
    o0 = np.array([in_force[f"INS_ACCOFFS_{a}"] for a in "XYZ"])
    s1, o1 = np.array(MOVED["scale"]), np.array(MOVED["offset"])
    change = [
        ParameterValue(f"INS_ACC{kind}_{a}", float(x))
        for kind, values in (("SCAL", s1), ("OFFS", o1))
        for a, x in zip("XYZ", values, strict=True)
    ]
    now = [
        dataclasses.replace(s, f_b=tuple(float(x) for x in (np.array(s.f_b) / s0 + o0 - o1) * s1))
        if isinstance(s, ImuSample)
        else s
        for s in after
    ]
    changed, plain = calibrated([*before, *change, *now]), calibrated([*before, *after])
    assert_same(changed, plain, 1e-7)
    assert changed.in_force_scale == pytest.approx(MOVED["scale"])
    assert changed.in_force_offset == pytest.approx(MOVED["offset"])


@pytest.mark.slow
def test_the_finer_stream_is_preferred(short):
    def fine(sample):
        return dataclasses.replace(exact(sample), source=ImuSource.HIGHRES_IMU)

    def coarse(sample):
        f = tuple(x + 1.0 for x in sample.f_b)  # would be seen
        return dataclasses.replace(sample, f_b=f, t=sample.t + 1e-3)

    alone, both = [], []
    for s in short:
        if isinstance(s, ImuSample):
            assert s.source is ImuSource.RAW_IMU
            alone.append(fine(s))
            both += [fine(s), coarse(s)]
        else:
            alone.append(s)
            both.append(s)
    assert_same(calibrated(both), calibrated(alone))


@pytest.mark.slow
def test_a_reboot_in_flight_keeps_what_was_learnt(copter, of_copter):
    before, after = split(copter, 65.0)
    start = next(s.t for s in after if isinstance(s, ImuSample)) - 4.0
    moved = [
        s if time_of(s) is None else dataclasses.replace(s, t=s.t - start)
        for s in after
        if not isinstance(s, ParameterValue)
    ]
    made = Calibrator()
    events = [e for s in [*before, *moved] for e in made.feed(s)]
    made.finish()
    assert [e.reason for e in events if isinstance(e, Restarted)] == ["reboot"]
    got = made.calibration(1)
    assert_true(got)
    assert got.trusted_s > of_copter.trusted_s - 15.0
    assert got.rejected["reboots"] == 1


@pytest.mark.slow
def test_twenty_seconds_without_gps(copter):
    got = calibrated([s for s in copter if not (isinstance(s, GpsFix) and 50.0 < s.t < 70.0)])
    assert got.status is Status.CALIBRATED
    assert_true(got)


@pytest.fixture(scope="module")
def halves(copter):
    before, after = split(copter, 65.0)
    return fed(before), [*parameters_of(before), *after]


@pytest.mark.slow
def test_saved_sums_go_on_where_they_stopped(halves):
    first, rest = halves
    assert first.parameters.device_id(1)
    alone = fed(rest).calibration(1)
    got = fed(rest, Calibrator.from_bytes(first.to_bytes())).calibration(1)
    assert_true(got)
    assert got.trusted_s == pytest.approx(first.calibration(1).trusted_s + alone.trusted_s, rel=0.1)
    assert np.linalg.slogdet(got.covariance)[1] < np.linalg.slogdet(alone.covariance)[1]


@pytest.fixture(scope="module")
def saved():
    """What a hop leaves behind."""
    return fed(flown("copter", 50.0)[0]).to_bytes()


@pytest.mark.slow
def test_sums_that_wait_for_their_sensor_are_not_lost(saved):
    restored = Calibrator.from_bytes(saved)
    assert restored.waiting == (1,)
    assert restored.to_bytes() == saved


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d[:-30],
        lambda d: b"",
        lambda d: d.replace(b'"prior"', b'"later"'),
        lambda d: d[::-1],
    ],
)
def test_damaged_state_is_refused(saved, damage):
    with pytest.raises(StateError):
        Calibrator.from_bytes(damage(saved))


@pytest.mark.slow
def test_a_latency_that_no_receiver_has_is_not_believed(copter):
    """GPS that is stamped a third of a second before it is true: another clock, not a receiver."""
    early = [
        dataclasses.replace(s, t=s.t - 0.35, t_message=None) if isinstance(s, GpsFix) else s
        for s in copter
    ]
    got = calibrated(early)
    assert got.status is Status.INSUFFICIENT
    assert "the latency of GPS would have to be further off" in got.note
