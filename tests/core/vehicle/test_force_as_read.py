"""The force that a vehicle model is held against is the true one, whatever the sensor makes of it.

Readings are those of the simulator's accelerometer, which shares nothing with the columns.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.misread import Misread, attitude_error
from onboard.core.inputs.segments import Segment
from onboard.core.maths.frames import rotation_from_euler, rotation_from_vector
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import GyroTiming, Six
from onboard.core.model.regressors import Family, Model
from onboard.core.physics.catalogue import kinds
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.accelerometer_hysteresis import AccelerometerHysteresis
from onboard.core.physics.effects.bias_ramp import BiasRamp
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.cross_axis import CrossAxis
from onboard.core.physics.effects.empirical import Empirical
from onboard.core.physics.effects.gravity import Gravity
from onboard.core.physics.effects.load_flex import LoadFlex
from onboard.core.physics.effects.mount_tilt import MountTilt
from onboard.core.physics.effects.offset_wander import OffsetWander
from onboard.core.physics.effects.scale_nonlinearity import ScaleNonlinearity
from onboard.core.physics.effects.scale_step import ScaleStep
from onboard.core.physics.effects.temperature_drift import TemperatureDrift
from onboard.core.physics.effects.throttle_coupling import ThrottleCoupling
from onboard.core.physics.effects.vibration_rectification import VibrationRectification
from onboard.core.physics.octaves import WEIGHTS
from onboard.core.vehicle.trajectory import Sensors
from sitl.builtin import effects as made
from sitl.builtin.effects import accelerometer_hysteresis as lagging
from sitl.builtin.effects.base import Scene

T = np.arange(0.0, 40.0, 0.02)
CUT = 1000
"""Two segments, the second of which begins a second before the first ends."""
STILL = np.zeros((len(T), 3))
W = np.stack([0.5 * np.sin(T), 0.4 * np.cos(1.3 * T), 0.2 * np.sin(0.7 * T)], axis=1)
F = np.stack([2.0 * np.sin(2.1 * T), 1.5 * np.cos(1.2 * T), -9.8 + 3.0 * np.sin(0.9 * T)], axis=1)
TEMPERATURE, THROTTLE = 25.0 + 0.3 * T, 0.5 + 0.2 * np.sin(0.8 * T)
VIBRATION = np.stack([3.0 + np.sin(0.3 * T), 4.0 + np.cos(0.2 * T), 5.0 + 0.1 * T], axis=1)
SCALE, OFFSET = np.array([1.02, 0.985, 1.015]), np.array([0.1, -0.2, 0.15])
ORIGIN = Origin(t0=0.0)
MOMENT = 17.0
ON_AXES = {"x": 0.3, "y": -0.25, "z": 0.2}
SIZES = np.array(list(ON_AXES.values()))
SLOW = {"temperature": (T, TEMPERATURE), "throttle": (T, THROTTLE), "vibration": (T, VIBRATION)}


def small(by):
    return {axis: by * size for axis, size in ON_AXES.items()}


@dataclass
class Case:
    """A piece of physics as the simulator has it, as the product has it, and its sizes there."""

    simulated: made.Effect
    family: Family
    sizes: np.ndarray


TILT, PAIRS = {"roll": 0.05, "pitch": -0.04}, {"xy": 0.02, "xz": -0.03, "yz": 0.03, "zx": 0.02}
LOOP = np.array([0.2, 0.15, 0.2])
CASES = {
    "nonlinearity": Case(
        made.ScaleNonlinearity(**small(0.1)), ScaleNonlinearity(ORIGIN), 0.1 * SIZES
    ),
    "axes": Case(
        made.CrossAxis(**PAIRS),
        CrossAxis(ORIGIN),
        np.array([PAIRS.get(p, 0.0) for p in CrossAxis.keys]),
    ),
    "tilt": Case(
        made.AccelerometerTilt(**TILT), MountTilt(ORIGIN), np.array([*TILT.values()])
    ),
    "mount": Case(made.LoadFlex(**TILT), LoadFlex(ORIGIN), np.array([*TILT.values()])),
    "ramp": Case(made.BiasRamp(**small(0.03)), BiasRamp(ORIGIN), 0.03 * SIZES),
    "jump": Case(
        made.BiasStep(time=MOMENT, **ON_AXES), BiasStep(ORIGIN).at(MOMENT), SIZES
    ),
    "scale": Case(
        made.ScaleStep(time=MOMENT, **small(0.1)), ScaleStep(ORIGIN).at(MOMENT, 0.1), 0.1 * SIZES
    ),
    "warmth": Case(
        made.TemperatureDrift(reference=35.0, **small(0.1)), TemperatureDrift(ORIGIN), 0.1 * SIZES
    ),
    "throttle": Case(made.ThrottleCoupling(**ON_AXES), ThrottleCoupling(ORIGIN), SIZES),
    "vibration": Case(
        made.VibrationRectification(**small(0.05)), VibrationRectification(ORIGIN), 0.05 * SIZES
    ),
    "loop": Case(
        lagging.AccelerometerHysteresis(x=LOOP[0], y=LOOP[1], z=LOOP[2], width=2.0),
        AccelerometerHysteresis(ORIGIN),
        # All of it in the play of the middle, whose half-width this is.
        (np.linalg.inv(WEIGHTS.T) @ np.outer([0.0, 1.0, 0.0], LOOP)).ravel(),
    ),
    "nameless": Case(
        made.Nameless(term="roll_rate", **ON_AXES),
        Empirical(ORIGIN).of("wx", "w_x", lambda nodes: nodes.w_b[..., 0]),
        SIZES,
    ),
}  # fmt: skip


def segments(raw):
    """The flight as two segments that overlap."""
    for cut in (slice(0, CUT + 50), slice(CUT, None)):
        yield Segment(T[cut], W[cut], raw[cut], T[:2], np.tile(np.eye(3), (2, 1, 1)), np.eye(3),
                      dict(SLOW))  # fmt: skip


def undone(sensors, raw):
    """The force of the whole flight, segment by segment."""
    first, second = segments(raw)
    f_first, before = sensors.force(first, None)
    f_second, _ = sensors.force(second, before)
    return np.concatenate([f_first[:CUT], f_second])


def knowing(family, sizes):
    model = Model([Six(), family])
    theta = np.concatenate([SCALE, -SCALE * OFFSET, sizes])
    return Sensors(SCALE, OFFSET, np.zeros(3), misread=Misread(model, theta))


@pytest.mark.parametrize("name", CASES)
def test_all_that_is_known_of_a_reading_is_taken_off(name):
    case = CASES[name]
    motion = SimpleNamespace(w_b=W, throttle=THROTTLE, airspeed=0.0 * T, v_n=STILL)
    scene = Scene(F, T, TEMPERATURE, VIBRATION, motion)
    wrong = case.simulated.reads_too_much(scene)
    raw = (F + wrong) / SCALE + OFFSET
    family = case.family
    if isinstance(family, Effect):
        family = family.about(case.sizes)
    left = undone(knowing(family, case.sizes), raw) - F
    alone = undone(Sensors(SCALE, OFFSET, np.zeros(3)), raw) - F
    np.testing.assert_allclose(alone, wrong, atol=1e-9)
    # Sizes act to first order, and a loop is followed from sample to sample.
    assert np.sqrt(np.mean(left**2)) < 0.06 * np.sqrt(np.mean(wrong**2))


def test_of_every_effect_that_an_accelerometer_reads_it_is_known():
    """A new one that changes the force is among those above, or is not read."""
    acting = {k for k in kinds() if k.acceleration is not Family.acceleration and k.is_read}
    # A wander is a function of time and of nothing that a simulated force could show: its curve.
    assert acting - {OffsetWander} == {type(case.family) for case in CASES.values()}


@pytest.mark.parametrize(
    ("family", "size"), [(Gravity(ORIGIN), 0.04), (GyroTiming(), 0.005)], ids=["gravity", "timing"]
)
def test_what_is_not_read_is_no_error_of_the_reading(family, size):
    """Another gravity, and an attitude that is late, change what the velocity does."""
    raw = F / SCALE + OFFSET
    np.testing.assert_allclose(undone(knowing(family, np.array([size])), raw), F, atol=1e-9)


def test_an_attitude_that_is_turned_all_flight_long_is_turned_back():
    """By angles of the body, and a heading to north, that the sums have found."""
    tilt, heading, taken = np.array([0.05, -0.04, 0.0]), 0.06, 0.02
    model = calibration_model(point := Linearisation(heading=taken))
    theta = np.zeros(model.size)
    for name, value in zip(
        ("tilt_roll", "tilt_pitch", "heading"), (*tilt[:2], heading - taken), strict=True
    ):
        theta[model.index[name]] = value
    known = 0.01 + 0.001 * np.arange(model.size)
    found = SimpleNamespace(theta=theta, covariance=np.diag(known**2))
    engine = SimpleNamespace(solution=lambda: found, model=model, point=point)
    true = rotation_from_euler(0.3 * np.sin(T), 0.2 * np.cos(T), 0.1 * T)
    turn = rotation_from_vector(np.array([[0.0, 0.0, heading]]))
    recorded = turn @ true @ rotation_from_vector(tilt[None])
    off, sigma = attitude_error(engine)
    places = [model.index[name] for name in ("tilt_roll", "tilt_pitch", "heading")]
    np.testing.assert_allclose(sigma, known[places])
    sensors = Sensors(SCALE, OFFSET, np.zeros(3), tilt=off, tilt_sigma=sigma)
    np.testing.assert_allclose(sensors.attitude(recorded), true, atol=0.005)
    assert np.abs(recorded - true).max() > 0.05
