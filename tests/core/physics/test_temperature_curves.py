"""The law of a temperature drift: ArduPilot's three powers, and no more than a flight can tell."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.answer import answer
from onboard.core.estimate.result import Status
from onboard.core.model.quadrature import Signals
from onboard.core.physics.catalogue import response_of
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.temperature_drift import TemperatureDrift
from onboard.core.physics.finding import Finding, Quantity
from sitl.builtin import effects as concealed
from sitl.builtin.truth import ImuTruth
from tests.core.diagnosis.flights import batches, resting
from tests.core.estimate.test_simulated_flights import fed
from tests.core.estimate.test_simulated_flights import flown as simulated

ORIGIN = Origin(t0=100.0)
IMU = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SIX = np.array(IMU.scale + IMU.offset)


def flight(low, high):
    t = np.linspace(100.0, 161.0, 120)
    slow = {"temperature": (t, np.linspace(low, high, 120))}
    return batches(resting(np.random.default_rng(0), 60.0), slow=slow)


def columns(effect, flown, t):
    nodes = Signals(t, *(np.zeros((len(t), 3)),) * 3, flown)
    return -effect.acceleration(nodes)


def test_a_flight_that_hardly_warms_up_has_a_line():
    drift = TemperatureDrift(ORIGIN)
    assert len(drift.told_by(flight(30.0, 39.0)).unknowns) == 3
    assert not drift.told_by(flight(30.0, 39.0)).simpler()


def test_one_that_warms_up_has_three_powers_and_simpler_forms_of_them():
    curve = TemperatureDrift(ORIGIN).told_by(flight(20.0, 50.0))
    assert len(curve.unknowns) == 9
    names = [u.name for u in curve.unknowns]
    for simpler, k in zip(curve.simpler(), (3, 6), strict=True):
        assert [u.name for u in simpler.unknowns] == names[:k], (
            "columns of its own, the first of it"
        )
        assert simpler.keys == curve.keys == ("x", "y", "z")


@pytest.mark.parametrize("law", [(0.01, 0.0, 0.0), (0.0, 0.002, 0.0), (-0.004, 3e-4, -2e-5)])
def test_every_polynomial_of_ardupilots_is_one_of_them_and_the_size_is_its_mean_slope(law):
    batch = flight(20.0, 50.0)[3]
    t, T = batch.segment.slow["temperature"]
    curve = TemperatureDrift(ORIGIN).told_by(flight(20.0, 50.0))
    curve.flown = (T[0], T[-1])
    made = columns(curve, batch.segment, t)
    offset = sum(c * (T - 35.0) ** (k + 1) for k, c in enumerate(law))
    A = np.column_stack([np.ones(len(t)), made[:, 2, 2::3]])
    size = np.linalg.lstsq(A, offset, rcond=None)[0]
    assert A @ size == pytest.approx(offset, abs=1e-9)
    slope = np.polyfit(T, offset, 1)[0]
    assert size[1] == pytest.approx(slope, abs=0.02 * np.ptp(offset) / np.ptp(T))
    assert not made[:, 0, 2::3].any(), "an axis acts on itself alone"


@pytest.mark.parametrize("flown", [(20.0, 50.0), (10.0, 28.0), (33.0, 70.0), (40.0, 60.0)])
def test_at_the_reference_it_adds_nothing_to_the_offset_whatever_its_shape(flown):
    batch = flight(20.0, 50.0)[0]
    t = batch.segment.t[:3]
    there = replace(batch.segment, slow={"temperature": (t, np.full(3, 35.0))})
    curve = TemperatureDrift(ORIGIN).told_by(flight(*flown))
    assert len(curve.unknowns) == 9
    assert columns(curve, there, t) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("flown", "open_"), [((20.0, 50.0), False), ((40.0, 60.0), True)])
def test_what_is_not_known_beyond_what_was_flown_is_in_the_sigma_of_the_offset(flown, open_):
    """Of a line nobody has seen that it goes on straight to where the offset is said to be."""
    curve = TemperatureDrift(ORIGIN).told_by(flight(*flown))
    line = curve.simpler()[0]
    whole = line.opened()
    assert len(whole.unknowns) == (9 if open_ else 3)
    assert whole.keys == line.keys
    assert curve.opened().unknowns == curve.unknowns
    batch = flight(*flown)[3]
    t = batch.segment.slow["temperature"][0]
    sigma = {}
    for effect in (line, whole):
        made = columns(effect, batch.segment, t)
        A = np.column_stack([np.ones(len(t)), made[:, 2, 2::3]])
        sigma[effect] = np.sqrt(np.linalg.inv(A.T @ A)[0, 0])
    # The offset 5 K below 20 K that were flown; 9 by the bend and 25 by the twist as it is there.
    assert sigma[whole] >= (5.0 if open_ else 1.0) * sigma[line]
    assert not TemperatureDrift(ORIGIN).opened().shaped, "without a flight there is no range"


def test_its_curve_is_drawn_with_its_shape_and_said_by_its_range():
    warm = flight(20.0, 50.0)
    curve = TemperatureDrift(ORIGIN).told_by(warm)
    theta = np.zeros(9)
    theta[5], theta[2] = 0.4, 1e-3  # z: a bend
    sizes = {a: Quantity(theta[i], 1e-3, "m/s^2/K") for i, a in enumerate("xyz")}
    line = response_of("temperature_drift", sizes, warm, 100.0, 35.0)
    bent = curve.bent(line, theta, np.diag(np.full(9, 1e-6)))
    low, high = curve.flown
    u = np.clip((2.0 * line.x - low - high) / (high - low), -1.0, 1.0)
    about = (70.0 - low - high) / (high - low)  # where nothing is left, for the six have it
    assert bent.y["z"] == pytest.approx(1e-3 * (line.x - 35.0) + 0.6 * (u**2 - about**2))
    assert bent.y["x"] == pytest.approx(0.0)
    assert np.all(bent.sigma["z"] > 0.0)

    def said(of):
        made = Finding("temperature_drift", sizes, 0.5, -9.0, 2.0, 1.0, {}, "", response_curve=of)
        return TemperatureDrift.size(made), TemperatureDrift.condition(made, 0.2, 1e-3)

    assert "by up to 0.6" in said(bent)[0]
    assert "along a curve" in said(bent)[1]
    assert "between" not in said(line)[0]
    assert "along a curve" not in said(line)[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "square", "cube"),
    [
        ("copter", (2e-3, -1e-3, 2e-3), (0.0,) * 3),
        ("plane", (0.0,) * 3, (3e-4, 2e-4, -3e-4)),
    ],
)
def test_warming_up_along_a_curve_is_told_as_temperature(vehicle, square, cube):
    drift = concealed.TemperatureDrift(square=square, cube=cube)
    samples = simulated(vehicle, 190.0, seed=14, imu=IMU, effects=[drift])[0]
    found = answer(fed(samples), 1)
    assert found.calibration.status is not Status.CALIBRATED
    (told,) = [e for e in found.diagnosis.effects if e.name != "gps_latency"]
    assert told.name == "temperature_drift"
    curve = told.response_curve
    u = curve.x - 35.0
    for j, axis in enumerate("xyz"):
        law = square[j] * u**2 + cube[j] * u**3
        off = (curve.y[axis] - law) - np.mean(curve.y[axis] - law)
        assert np.sqrt(np.mean(off**2)) < 0.25 * np.std(law) + 0.01
    c = found.calibration
    error = np.array(c.scale + c.offset) - SIX
    chi_square = error @ np.linalg.solve(c.with_its_gyroscope, error)
    assert chi_square < 22.5, "of the six at 35 degC: one flight in a thousand"


@pytest.mark.slow
@pytest.mark.parametrize(("cold", "warm"), [(44.0, 68.0), (-8.0, 26.0)])
def test_the_offset_at_a_reference_that_was_not_flown_is_no_surer_than_its_curve(cold, warm):
    """The second flight also passes 0 degC, which an autopilot tells as a temperature unknown."""
    imu = replace(IMU, temperature_start=cold, temperature_end=warm, temperature_time=60.0)
    drift = concealed.TemperatureDrift(
        x=0.004, y=-0.002, square=(8e-4, -6e-4, 2e-4), cube=(1e-5, -1e-5, -6e-6)
    )
    samples = simulated("copter", 200.0, seed=23, imu=imu, effects=[drift])[0]
    found = answer(fed(samples), 1)
    (told,) = [e for e in found.diagnosis.effects if e.name != "gps_latency"]
    assert told.name == "temperature_drift"
    c = found.calibration
    error = np.array(c.scale + c.offset) - SIX
    chi_square = error @ np.linalg.solve(c.with_its_gyroscope, error)
    assert chi_square < 22.5, "of the six at 35 degC: one flight in a thousand"


@pytest.mark.slow
def test_growth_with_time_is_no_curve_over_a_temperature_that_grows_as_well():
    ramp = concealed.BiasRamp(x=2e-3, y=-2e-3, z=2e-3)
    samples = simulated("copter", 190.0, seed=14, imu=IMU, effects=[ramp])[0]
    (told,) = [e for e in answer(fed(samples), 1).diagnosis.effects if e.name != "gps_latency"]
    assert told.name == "bias_ramp"
