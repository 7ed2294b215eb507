"""An offset that wanders: its likelihood by sums, its false alarms, simulated flights with it."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.records import Verdict
from onboard.core.diagnosis.score import surprise
from onboard.core.diagnosis.wander import WAVES, by_blocks
from onboard.core.estimate.result import Status
from onboard.core.estimate.solution import solve
from onboard.core.maths.flicker import waves, waves_variance
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.offset_wander import OffsetWander
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from tests.core.diagnosis.problems import BLOCK_S, SIX, Columns, drawn
from tests.core.diagnosis.test_sealed_recordings import examined

BLOCKS, ROWS = 20, 30
MORE = (Columns("late", 1),)
THETA = np.concatenate([SIX, [0.3]])
INSTABILITY = np.array([0.3, 0.0, 0.2])


def flight(seed, instability=(0.0, 0.0, 0.0)):
    """Rows whose offsets are other ones in each block."""
    rng = np.random.default_rng(seed)
    made = drawn(rng, MORE, THETA, blocks=BLOCKS, rows=ROWS)
    middle = BLOCK_S * (np.arange(BLOCKS) + 0.5)
    sigma = np.sqrt(waves_variance(WAVES))[:, None] * np.array(instability)
    off = waves(middle, 0.0, BLOCK_S * BLOCKS, WAVES) @ (sigma * rng.normal(size=(WAVES, 3)))
    return replace(made, y=made.y + np.einsum("bri,bi->br", made.h[:, :, 3:6], off))


def told(made):
    return by_blocks(made.blocks, made.model, solve(made.blocks, made.model).nis)


def dense(made, instability):
    """Logarithm of the likelihood of all rows, everything integrated out."""
    h, y = made.rows
    middle = np.repeat(BLOCK_S * (np.arange(BLOCKS) + 0.5), ROWS)
    wave = waves(middle, 0.0, BLOCK_S * BLOCKS, WAVES)
    amplitudes = (wave[:, :, None] * h[:, None, 3:6]).reshape(len(h), -1)
    variance = (waves_variance(WAVES)[:, None] * instability**2).ravel()
    C = np.eye(len(y)) + (h * made.model.prior_sigma**2) @ h.T
    C += (amplitudes * variance) @ amplitudes.T
    e = y - h @ made.model.prior
    return -0.5 * (e @ np.linalg.solve(C, e) + np.linalg.slogdet(C)[1])


def test_the_likelihood_is_that_of_the_rows():
    made = flight(3, INSTABILITY)
    nis = solve(made.blocks, made.model).nis
    asked = by_blocks(made.blocks, made.model, 1.0)
    for instability in (INSTABILITY, 0.5 * INSTABILITY, np.array([0.0, 0.4, 0.0])):
        gain = dense(made, instability) - dense(made, np.zeros(3))
        assert asked.likelier(instability) == pytest.approx(gain, rel=1e-6)
    # Louder noise is less evidence.
    assert nis > 1.0
    assert told(made).likelier(INSTABILITY) < asked.likelier(INSTABILITY)


def test_how_much_it_wanders_is_found():
    found = np.array([told(flight(seed, INSTABILITY)).likeliest()[0] for seed in range(24)])
    spread = found.std(axis=0) / np.sqrt(len(found))
    assert np.all(np.abs(found.mean(axis=0) - INSTABILITY)[[0, 2]] < 4.0 * spread[[0, 2]] + 0.02)
    assert np.median(found[:, 1]) < 0.05


def test_of_flights_that_do_not_wander_no_more_are_suspected_than_stated():
    gains = np.array([told(flight(seed)).likeliest()[1] for seed in range(100)])
    for chance in (0.2, 0.05):
        suspected = np.mean([surprise(2.0 * g, 3) >= -2.0 * np.log(chance) for g in gains])
        assert suspected <= chance, "chi-square with three degrees of freedom is more than enough"
    assert np.mean(gains == 0.0) > 0.05, "at the bound there is often nothing to gain"


def test_its_size_is_what_its_curve_is_over_the_flight():
    rng = np.random.default_rng(8)
    wander = OffsetWander(Origin(10.0)).along(10.0, 110.0, np.array([0.1, 0.0, 0.2]), WAVES)
    assert wander.keys == ("x", "z")
    theta = rng.normal(size=len(wander.unknowns)) * [u.prior_sigma for u in wander.unknowns]
    size = wander.sized(theta, np.eye(len(theta)) * 1e-4)
    t = 10.0 + 100.0 * (np.arange(5000) + 0.5) / 5000
    for i, axis in enumerate(wander.keys):
        curve = waves(t, 10.0, 110.0, WAVES) @ theta[i::2]
        assert size[axis].value == pytest.approx(np.sqrt(np.mean(curve**2)), rel=1e-6)
        assert size[axis].sigma == pytest.approx(0.01)
    assert np.all((wander.unsteady() > 0.0) == [True, False, True])


@pytest.mark.slow
def test_a_sensor_that_wanders_is_said_to_and_is_calibrated_all_the_same():
    imu = random_imus(51)[0]
    wander = concealed.OffsetWander(x=0.06, y=0.06, z=0.06, seed=3)
    _, found = examined("plane", 51, wander, duration=200.0)
    said = found.diagnosis()
    assert [e.name for e in said.effects] == ["offset_wander"]
    assert said.verdict is Verdict.EXPLAINED
    made = said.calibration
    assert made.status is Status.CALIBRATED
    # That it will be another one in the next flight is in the sigma of an offset.
    for now, true, sigma in (
        (made.scale, imu.scale, made.scale_sigma),
        (made.offset, imu.offset, made.offset_sigma),
    ):
        assert np.all(np.abs(np.subtract(now, true)) < 3.5 * np.array(sigma))
    assert min(made.offset_sigma) > 0.02


@pytest.mark.slow
def test_what_else_is_there_is_found_beside_it():
    arm = {"x": -0.4, "y": 0.0, "z": -0.5}
    wander = concealed.OffsetWander(x=0.06, y=0.06, z=0.06, seed=2)
    _, found = examined("copter", 52, wander, concealed.GpsLeverArm(**arm), duration=200.0)
    said = found.diagnosis()
    assert {e.name for e in said.effects} == {"gps_lever_arm", "offset_wander"}
    (place,) = (e for e in said.effects if e.name == "gps_lever_arm")
    for axis, true in arm.items():
        assert abs(place.unknowns[axis].value - true) < 4.0 * place.unknowns[axis].sigma
