"""Each concealed effect changes exactly what the catalogue says, by exactly so much."""

import dataclasses

import numpy as np
import pytest

from sitl.builtin import effects as fx
from sitl.builtin import rotation
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.copter import HOVER_THROTTLE
from sitl.builtin.gps import Receiver
from sitl.builtin.sensors import CRUISE_THROTTLE, low_pass_response, read_imu, vibration_level
from sitl.builtin.smoothing import DT
from sitl.builtin.trajectory import Environment
from sitl.builtin.truth import GpsTruth, ImuTruth, Truth
from sitl.builtin.world import World

G = 9.80665
START = 6.0
QUIET = ImuTruth(accel_noise=0.0, bias_walk=0.0, broadband=0.0, vibration=(0.0, 0.0, 0.0))
EXACT = GpsTruth(
    jitter=0.0,
    velocity_noise=0.0,
    velocity_coloured=0.0,
    position_noise=0.0,
    position_coloured=0.0,
)
STEP = 16.0 * G / 32768.0
"""Resolution of the sensor: nothing raw is finer."""


def truth(*effects, imu=QUIET, gps=EXACT):
    return Truth(imus=(imu, imu), gps=gps, effects=effects, seed=3)


@pytest.fixture(scope="module")
def trajectory():
    world = World("copter", truth())
    world.park(START)
    world.launch(START, 80.0)
    return world.pieces[-1].trajectory


def read(trajectory, hardware, index=0):
    return read_imu(
        trajectory, hardware, index, start=START, accel_filter_hz=20.0, gyro_filter_hz=20.0
    )


def added(trajectory, effect, **more):
    """What the effect adds to the raw reading of IMU 1, (n, 3)."""
    plain, changed = (read(trajectory, truth(*e, **more)) for e in ((), (effect,)))
    return changed.raw - plain.raw


def elapsed(trajectory):
    return START + np.arange(trajectory.n) * DT


def expected(trajectory, effect):
    f = trajectory.f_b
    match effect:
        case fx.CrossAxis():
            M = np.array(
                [[0, effect.xy, effect.xz], [effect.yx, 0, effect.yz], [effect.zx, effect.zy, 0]]
            )
            return f @ M.T
        case fx.TemperatureDrift():
            warm = 25.0 + 20.0 * (1.0 - np.exp(-elapsed(trajectory) / 180.0))
            return np.outer(warm - effect.reference, (effect.x, effect.y, effect.z))
        case fx.BiasRamp():
            return np.outer(elapsed(trajectory), (effect.x, effect.y, effect.z))
        case fx.BiasStep():
            return np.outer(elapsed(trajectory) >= effect.time, (effect.x, effect.y, effect.z))
        case fx.ScaleStep():
            later = elapsed(trajectory) >= effect.time
            return later[:, None] * np.array((effect.x, effect.y, effect.z)) * f
        case fx.ScaleNonlinearity():
            return np.array((effect.x, effect.y, effect.z)) * f**2 / G
        case fx.ThrottleCoupling():
            return np.outer(trajectory.throttle, (effect.x, effect.y, effect.z))
        case fx.LoadFlex():
            load = -f[:, 2] / G - 1.0
            flex = np.outer(load, (effect.roll, effect.pitch, 0.0))
            return np.cross(flex, f)
    raise AssertionError(effect)


@pytest.mark.parametrize(
    "effect",
    [
        fx.CrossAxis(xy=0.02, xz=-0.01, yx=0.03, yz=0.01, zx=-0.02, zy=0.015),
        fx.TemperatureDrift(x=0.03, y=-0.02, z=0.025),
        fx.BiasRamp(x=0.002, y=-0.001, z=0.003),
        fx.BiasStep(time=40.0, x=0.2, y=-0.1, z=0.3),
        fx.ScaleStep(time=40.0, x=0.02, y=-0.01, z=0.03),
        fx.ScaleNonlinearity(x=0.01, y=-0.02, z=0.005),
        fx.ThrottleCoupling(x=0.3, y=-0.2, z=0.4),
        fx.LoadFlex(roll=0.01, pitch=-0.015),
    ],
    ids=lambda e: e.name,
)
def test_accelerometer_effects(trajectory, effect):
    difference = added(trajectory, effect) - expected(trajectory, effect)
    # Rounding on both sides, and the second order of a small rotation.
    assert np.abs(difference).max() < 1.01 * STEP + 3e-3 * isinstance(effect, fx.LoadFlex)


def test_effect_on_one_accelerometer_leaves_the_other_alone(trajectory):
    hardware = truth(fx.BiasStep(time=0.0, x=0.5, imu=2))
    for index, wanted in ((0, 0.0), (1, 0.5)):
        plain = read(trajectory, truth(), index).raw
        assert (read(trajectory, hardware, index).raw - plain)[:, 0] == pytest.approx(
            wanted, abs=1.01 * STEP
        )


def test_vibration_rectification_follows_the_reported_level(trajectory):
    shaken = dataclasses.replace(QUIET, vibration=(1.0, 1.5, 2.0), broadband=0.3)
    effect = fx.VibrationRectification(x=0.02, y=-0.01, z=0.03)
    plain = read(trajectory, truth(imu=shaken))
    difference = added(trajectory, effect, imu=shaken)
    assert (
        np.abs(difference - np.array([0.02, -0.01, 0.03]) * plain.vibration**2).max() < 1.01 * STEP
    )
    assert plain.vibration[40_000:70_000].mean(axis=0).min() > 0.5


def test_saturation_clips_the_raw_sensor_and_counts(trajectory):
    reading = read(trajectory, truth(fx.Saturation(limit=11.0)))
    assert np.abs(reading.raw).max() == 11.0
    plain = read(trajectory, truth()).raw
    assert reading.clipped[-1] == np.any(np.abs(plain) >= 11.0, axis=1).sum() > 0
    inside = np.all(np.abs(plain) < 11.0, axis=1)
    assert np.array_equal(reading.raw[inside], plain[inside])


def fixes(trajectory, *effects, gps=EXACT):
    hardware = truth(*effects, gps=gps)
    return Receiver(hardware).read(trajectory, hardware, start=START)


def table(found):
    return np.array([f.v_n for f in found]), np.array([f.p_n for f in found])


def at(trajectory, x, times):
    grid = START + np.arange(trajectory.n) * DT
    return np.column_stack([np.interp(times, grid, x[:, i]) for i in range(3)])


def test_plain_receiver_tells_the_truth_late(trajectory):
    found = fixes(trajectory)
    v, p = table(found)
    valid = np.array([f.t_valid for f in found])
    assert np.abs(v - at(trajectory, trajectory.v_n, valid)).max() < 1e-9
    assert np.abs(p - at(trajectory, trajectory.p_n, valid)).max() < 1e-9
    assert np.allclose([f.t_arrival - f.t_valid for f in found], EXACT.delay)
    assert np.allclose([f.t_arrival - f.t_stamp for f in found], EXACT.stamped_early)


def test_gps_latency(trajectory):
    late = fixes(trajectory, fx.GpsLatency(delay=0.08))
    for a, b in zip(fixes(trajectory), late, strict=True):
        assert (a.v_n, a.p_n, a.t_valid) == (b.v_n, b.p_n, b.t_valid)
        assert b.t_arrival - a.t_arrival == pytest.approx(0.08)


def test_gps_smoothing_is_the_mean_over_the_window(trajectory):
    window = 0.3
    found = fixes(trajectory, fx.GpsSmoothing(window=window))
    v, _ = table(found)
    valid = np.array([f.t_valid for f in found])
    # The mean velocity over a span is the way made good in it.
    p = trajectory.p_n
    way = at(trajectory, p, valid + window / 2) - at(trajectory, p, valid - window / 2)
    inner = slice(5, -5)
    assert np.abs(v - way / window)[inner].max() < 1e-6


@pytest.mark.parametrize("damping", [0.4, 0.7])
def test_gps_overshoot_is_the_response_of_its_loop(trajectory, damping):
    hertz = 1.5
    w = 2.0 * np.pi * hertz
    found = fixes(trajectory, fx.GpsOvershoot(square=w**-2, damping=damping))
    v, p = table(found)
    valid = np.array([f.t_valid for f in found])
    # By frequencies, of a velocity that ends where it began: it is flown there and back.
    there_and_back = np.concatenate([trajectory.v_n, trajectory.v_n[::-1]])
    s = 2.0j * np.pi * np.fft.rfftfreq(len(there_and_back), DT)
    H = (2.0 * damping * w * s + w**2) / (s**2 + 2.0 * damping * w * s + w**2)
    loop = np.fft.irfft(
        H[:, None] * np.fft.rfft(there_and_back, axis=0), len(there_and_back), axis=0
    )
    settled = slice(int(5.0 * EXACT.rate), -5)
    off = v - at(trajectory, loop[: trajectory.n], valid)
    assert np.abs(off)[settled].max() < 1e-4
    assert np.abs(v - at(trajectory, trajectory.v_n, valid))[settled].max() > 0.05
    assert np.abs(p - at(trajectory, trajectory.p_n, valid)).max() < 1e-9


def test_gps_lever_arm(trajectory):
    arm = np.array([0.5, 0.2, -0.3])
    found = fixes(trajectory, fx.GpsLeverArm(x=0.5, y=0.2, z=-0.3))
    v, p = table(found)
    valid = np.array([f.t_valid for f in found])
    place = trajectory.p_n + trajectory.R_nb @ arm
    assert np.abs(p - at(trajectory, place, valid)).max() < 1e-9
    inner = slice(5, -5)
    moved = (at(trajectory, place, valid + 1e-3) - at(trajectory, place, valid - 1e-3)) / 2e-3
    assert np.abs(v - moved)[inner].max() < 1e-3


def test_clock_skew_makes_gps_later_and_later(trajectory):
    found = fixes(trajectory, fx.ClockSkew(rate=1e-3))
    v, _ = table(found)
    epochs = np.array([f.t_valid for f in found])
    assert np.abs(v - at(trajectory, trajectory.v_n, epochs * (1.0 - 1e-3)))[5:].max() < 1e-9


def test_gps_fault_is_in_the_velocity_between_two_times(trajectory):
    found = fixes(trajectory, fx.GpsFault(start=30.0, end=40.0, north=2.0, east=-1.0))
    for a, b in zip(fixes(trajectory), found, strict=True):
        inside = 30.0 <= b.t_valid < 40.0
        assert np.subtract(b.v_n, a.v_n) == pytest.approx([2.0 * inside, -inside, 0.0])
        assert a.p_n == b.p_n


def test_losses_glitches_and_jamming(trajectory):
    gps = dataclasses.replace(
        EXACT,
        velocity_noise=0.05,
        losses=((20.0, 25.0),),
        glitches=((30.0, 35.0, 100.0, 0.0),),
        jamming=((40.0, 60.0),),
    )
    found = fixes(trajectory, gps=gps)
    plain = fixes(trajectory, gps=dataclasses.replace(EXACT, velocity_noise=0.05))
    errors = np.array([np.linalg.norm(f.v_n) for f in found])
    assert np.isfinite(errors).all()
    for a, b in zip(plain, found, strict=True):
        assert (b.fix_type < 3) == (20.0 <= b.t_valid < 25.0)
        moved = b.p_n[0] - a.p_n[0]
        assert moved == pytest.approx(100.0 if 30.0 <= b.t_valid < 35.0 else 0.0)
        assert b.jammed == (40.0 <= b.t_valid < 60.0)


def attitudes(*effects, seconds=25.0):
    """Reported and true attitude, matrices, and throttle, of a true-attitude autopilot."""
    hardware = dataclasses.replace(truth(*effects), attitude_errors=False)
    autopilot = Autopilot("copter", hardware)
    autopilot.advance(START)
    autopilot.arm(force=True)
    autopilot.take_off(80.0)
    autopilot.advance(seconds)
    now = autopilot.instant()
    reported = rotation.from_euler(*now.attitude().reshape(3, 1))[0]
    return reported, now


def test_heading_error():
    reported, now = attitudes(fx.HeadingError(yaw=0.05))
    true = now.piece.trajectory.R_nb[now.row]
    assert np.allclose(reported, rotation.about_z(np.array([0.05]))[0] @ true, atol=1e-9)


def test_heading_by_throttle():
    reported, now = attitudes(fx.HeadingByThrottle(yaw_per_throttle=0.1))
    true = now.piece.trajectory.R_nb[now.row]
    turned = rotation.about_z(np.array([0.1 * now.throttle]))[0] @ true
    assert now.throttle > 0.1
    assert np.allclose(reported, turned, atol=1e-9)


def test_mount_tilt_is_fixed_in_the_body():
    reported, now = attitudes(fx.MountTilt(roll=0.01, pitch=-0.02))
    true = now.piece.trajectory.R_nb[now.row]
    assert np.allclose(
        reported, true @ rotation.from_vector(np.array([0.01, -0.02, 0.0])), atol=1e-9
    )


def test_accelerometer_tilt_turns_the_accelerometers_alone():
    """As SIM_ACC_TRIM: levelling (trim = atan2(-f_y, -f_z), atan2(f_x, |f_yz|)) gives it back."""
    readings = {}
    for effects in ((), (fx.AccelerometerTilt(roll=-0.03, pitch=0.025),)):
        world = World("copter", truth(*effects), dull=True)
        world.park(2.0)
        readings[bool(effects)] = world.pieces[0].imus[0]
    x, y, z = readings[True].raw.mean(axis=0)
    assert np.arctan2(-y, -z) == pytest.approx(0.03, abs=1e-3)
    assert np.arctan2(x, np.hypot(y, z)) == pytest.approx(-0.025, abs=1e-3)
    assert np.array_equal(readings[True].gyro, readings[False].gyro)


def test_board_tilt_turns_both_sensors_and_the_attitude_alike():
    reported, now = attitudes(fx.BoardTilt(roll=0.03, pitch=-0.025))
    straight, then = attitudes()
    board = rotation.from_euler(np.array([0.03]), np.array([-0.025]), np.zeros(1))[0]
    assert np.allclose(reported, straight @ board, atol=1e-9)
    row, one, other = now.row, now.piece.imus[0], then.piece.imus[0]
    assert np.allclose(one.raw[row], other.raw[row] @ board, atol=0.02)
    assert np.allclose(one.gyro[row], other.gyro[row] @ board, atol=1e-6 + 0.005 * 0.03)


def test_imu_delay_is_an_attitude_stamped_late():
    reported, now = attitudes(fx.ImuDelay(delay=0.05))
    assert np.allclose(reported, now.piece.trajectory.R_nb[now.row - 50], atol=1e-9)


def test_gravity_is_felt_by_who_stands_still():
    for delta in (0.0, 0.03):
        effects = (fx.Gravity(delta_g=delta),) if delta else ()
        world = World("copter", truth(*effects))
        world.park(2.0)
        mean = world.pieces[0].imus[0].raw.mean(axis=0)
        assert mean[2] == pytest.approx(-G - delta, abs=STEP)


def test_rotor_drag_is_how_it_flies():
    coefficients = []
    for effects in ((), (fx.RotorDrag(x=0.3, y=0.1),)):
        world = World("copter", truth(*effects))
        world.park(START)
        world.launch(START, 80.0)
        flown = world.pieces[-1].trajectory
        air = rotation.rotate_back(flown.R_nb, flown.v_n - np.array(Environment().wind_n))
        middle = slice(30_000, 50_000)
        speed = np.linalg.norm(air[middle], axis=1)
        force = flown.f_b[middle, :2] + 0.015 * speed[:, None] * air[middle, :2]
        coefficients.append(
            [
                -np.dot(force[:, i], air[middle, i]) / np.dot(air[middle, i], air[middle, i])
                for i in (0, 1)
            ]
        )
    assert coefficients[0] == pytest.approx([0.16, 0.20], abs=3e-3)
    assert coefficients[1] == pytest.approx([0.3, 0.1], abs=3e-3)


@pytest.mark.parametrize("cutoff", [10.0, 20.0, 42.0])
def test_low_pass_delays_by_what_it_declares_and_has_unit_gain(cutoff):
    h = low_pass_response(cutoff)
    assert h.sum() == pytest.approx(1.0, abs=1e-9)
    delay = np.sum(np.arange(len(h)) * h) * DT
    assert delay == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * cutoff), rel=0.01)
    tone = np.exp(-2j * np.pi * cutoff * DT * np.arange(len(h)))
    assert abs(np.sum(h * tone)) == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_vibration_level_is_the_deviation_of_a_tone():
    t = np.arange(20_000) * DT
    shake = np.column_stack([2.0 * np.sin(2 * np.pi * 80.0 * t)] * 3)
    keep = np.exp(-2.0 * np.pi * 5.0 * DT)  # the one-pole high-pass takes its share
    gain = abs(1.0 - (1.0 - keep) / (1.0 - keep * np.exp(-2j * np.pi * 80.0 * DT)))
    level = vibration_level(shake)[10_000:].mean()
    assert level == pytest.approx(gain * 2.0 / np.sqrt(2.0), rel=1e-3)


def test_tones_beyond_half_the_sampling_rate_fold():
    """A motor tone near 985 Hz looks like one at 15 Hz, and the low-pass lets it through."""
    at_hover = 985.0 / np.sqrt(HOVER_THROTTLE / CRUISE_THROTTLE)
    folding = dataclasses.replace(QUIET, vibration=(3.0, 0.0, 0.0), vibration_hz=at_hover)
    world = World("copter", truth(imu=folding), dull=True)
    world.park(START)
    world.launch(START, 60.0)
    piece = world.pieces[-1]
    plain = World("copter", truth(), dull=True)
    plain.park(START)
    plain.launch(START, 60.0)
    seen = (piece.imus[0].filtered - plain.pieces[-1].imus[0].filtered)[25_000:35_000, 0]
    assert seen.std() > 1.0
