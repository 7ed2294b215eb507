"""Forces of the simulated airframes balance, and drag, thrust and battery are what they claim."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from sitl.builtin import rotation
from sitl.builtin.airframe import copter_force, motors
from sitl.builtin.airframe.air import GRAVITY, Air, density, profile, turbulence
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.battery import discharge
from sitl.builtin.airframe.flight import flown
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.motion import Motion
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.smoothing import DT, integral
from sitl.builtin.trajectory import Environment, Start, specific_force_n

HOME = Environment()
BREEZE = Air(north=-3.0, east=2.0, exponent=0.5, turbulence=0.6, seed=3)
HEAVY = Airframe(
    mass=3.4, battCapacityAh=6.0, refBatRes=0.02, propExpo=0.4, motor_vector=(0.05, -0.03, -1.0)
)


def fly(craft, air, duration=60.0, seed=2):
    return Aircraft(craft=craft, air=air).fly(HOME, Start(), seed=seed, duration=duration)


def aloft(trajectory, margin=4.0):
    flying = np.flatnonzero(~trajectory.landed)
    return slice(flying[0] + round(margin / DT), flying[-1] - round((margin + 2.0) / DT))


@pytest.fixture(scope="module")
def copter():
    return fly(HEAVY, BREEZE)


@pytest.fixture(scope="module")
def plane():
    return fly(Wing(c_drag_p=0.13), dataclasses.replace(BREEZE, exponent=0.0), 80.0)


@pytest.fixture(params=["copter", "plane"])
def flight(request):
    return request.getfixturevalue(request.param)


def test_thrust_and_drag_are_mass_times_specific_force_to_machine_precision(flight):
    outputs = flight.outputs
    missing = outputs.mass[:, None] * flight.f_b - outputs.thrust_b - outputs.drag_b
    assert np.abs(missing[aloft(flight)]).max() < 1e-11


def test_specific_force_is_that_of_the_motion(flight):
    force = rotation.rotate(flight.R_nb, flight.f_b)
    assert np.abs(force - specific_force_n(flight.v_n, HOME)).max() < 1e-12
    assert np.abs(integral(flight.v_n) + flight.p_n[0] - flight.p_n).max() < 1e-9


def test_energy_goes_where_thrust_and_drag_do_work(flight):
    inside = aloft(flight)
    outputs = flight.outputs
    force_n = rotation.rotate(flight.R_nb, outputs.thrust_b + outputs.drag_b)
    power = np.einsum("ni,ni->n", force_n, flight.v_n)
    kinetic = 0.5 * outputs.mass * np.sum(flight.v_n**2, axis=1)
    energy = kinetic - outputs.mass * GRAVITY * flight.p_n[:, 2]
    work = integral(power[inside])
    change = energy[inside] - energy[inside][0]
    assert np.abs(work - change).max() < 1e-3 * np.abs(change).max()


@pytest.mark.parametrize("lag", [0.0, 0.06])
def test_pulse_widths_alone_integrate_to_the_velocity(lag):
    frame = Airframe(battCapacityAh=6.0, refBatRes=0.02, motor_lag=lag)
    flight = fly(frame, Air(north=4.0), 50.0)
    inside, outputs = aloft(flight), flight.outputs
    u_b = rotation.rotate_back(flight.R_nb, flight.v_n - outputs.wind_n)
    command = motors.command_of_pulse(frame, outputs.pwm)
    if lag:  # what a first-order motor makes of it
        for i in range(1, len(command)):
            command[i] = command[i - 1] + DT / lag * (command[i] - command[i - 1])
    force = motors.thrust(
        frame,
        command,
        density=outputs.density,
        inflow=np.maximum(0.0, -u_b[:, 2]),
        voltage=outputs.voltage,
    )
    total = np.sum(force, axis=1)
    force_b = copter_force.drag(frame, u_b, total, outputs.density)
    force_b[:, 2] -= total
    v_n = integral((rotation.rotate(flight.R_nb, force_b) / frame.mass + [0, 0, GRAVITY])[inside])
    true = flight.v_n[inside] - flight.v_n[inside][0]
    # The earth's rotation is not in this sum; of the lag, half a step is.
    assert np.abs(v_n - true).max() < (0.05 if not lag else 0.15)


def test_drag_grows_with_speed_as_its_two_parts_say():
    frame = Airframe()
    thrust, rho, step = np.array([30.0]), np.array([1.1]), 1e-5
    for speed in (-9.0, -2.0, 3.0, 12.0):
        u = np.array([[speed, 0.0, 0.0]])
        rise = np.array([[step, 0.0, 0.0]])
        slope = (
            copter_force.drag(frame, u + rise, thrust, rho)
            - copter_force.drag(frame, u - rise, thrust, rho)
        )[0, 0] / (2.0 * step)
        rotors = frame.mdrag_coef * np.sqrt(rho[0] * frame.disc_area * thrust[0])
        assert slope == pytest.approx(-rotors - rho[0] * frame.area_cd * abs(speed), rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "mcoef", "bcoef"),
    [
        ({}, 0.2483, 17.21),
        ({"mdrag_coef": 0.45}, 0.5587, 26.63),
        ({"mdrag_coef": 0.4}, 0.4967, 24.01),
        ({"refAngle": 25.0}, 0.2483, 91.78),
        ({"mass": 3.8, "hoverThrOut": 0.5}, 0.2206, 16.68),
    ],
)
def test_drag_coefficients_are_those_that_ardupilot_makes_of_the_frame(changes, mcoef, bcoef):
    frame = Airframe(**changes)
    assert frame.mcoef == pytest.approx(mcoef, rel=3e-4)
    assert frame.bcoef == pytest.approx(bcoef, rel=3e-4)
    assert frame.bcoef * frame.area_cd == pytest.approx(frame.mass)


def test_more_momentum_drag_than_drag_leaves_the_body_none():
    frame = Airframe(mdrag_coef=3.0)
    assert frame.area_cd == 0.0
    assert frame.momentum_coefficient < 3.0


def test_drag_by_the_filters_numbers_comes_back():
    frame = HEAVY.with_drag(mcoef=0.4, bcoef=40.0)
    assert frame.mcoef == pytest.approx(0.4, rel=1e-9)
    assert frame.bcoef == pytest.approx(40.0, rel=1e-9)
    only = HEAVY.with_drag(mcoef=0.1)
    assert only.bcoef == pytest.approx(HEAVY.bcoef, rel=1e-9)


def test_thrust_pulse_and_command_are_inverses():
    rng = np.random.default_rng(1)
    command = rng.uniform(0.05, 1.0, (200, 4))
    air = {
        "density": rng.uniform(0.9, 1.3, 200),
        "inflow": rng.uniform(0.0, 3.0, 200),
        "voltage": rng.uniform(10.0, 12.6, 200),
    }
    for expo in (0.0, 0.2, 0.65, 1.0):
        frame = Airframe(propExpo=expo)
        force = motors.thrust(frame, command, **air)
        assert np.allclose(motors.command(frame, force, **air), command, atol=1e-12)
        assert np.allclose(
            motors.command_of_pulse(frame, motors.pulse(frame, command)), command, atol=1e-12
        )


def test_hover_thrust_carries_the_weight_at_the_reference():
    frame = Airframe()
    share = motors.inverse_curve(np.full((1, 4), frame.hoverThrOut), frame.propExpo)
    force = motors.thrust(
        frame,
        share,
        density=np.array([frame.ref_density]),
        inflow=np.zeros(1),
        voltage=np.array([frame.maxVoltage]),
    )
    assert np.sum(force) == pytest.approx(frame.mass * GRAVITY)


def test_motors_share_the_thrust_exactly():
    rng = np.random.default_rng(4)
    total = rng.uniform(5.0, 60.0, 300)
    each = motors.shared(HEAVY, total, rng.normal(size=(300, 3)), 5.0 * rng.normal(size=(300, 3)))
    assert np.allclose(each.sum(axis=1), total, rtol=1e-12)
    assert each.min() > 0.0


def test_charge_and_voltage_of_the_battery_add_up():
    frame = Airframe(battCapacityAh=4.0, refBatRes=0.02)
    power = 350.0 + 150.0 * np.sin(np.arange(120_000) * DT)
    battery = discharge(frame, power)
    assert np.allclose(battery.voltage * battery.current, power, rtol=1e-12)
    drawn = integral(battery.current)[-1] / 3600.0
    assert battery.drawn[-1] == pytest.approx(drawn, rel=1e-12)
    rest = battery.voltage + battery.current * frame.refBatRes
    assert rest.max() <= frame.maxVoltage + 1e-9
    assert np.all(np.diff(rest) <= 1e-9)
    endless = discharge(Airframe(), power)
    assert np.all(endless.voltage == Airframe().maxVoltage)


def test_wind_blows_from_where_it_is_said_to_and_less_below():
    air = Air.from_settings(6.0, 300.0, 0.5)
    assert (air.north, air.east) == (pytest.approx(-3.0), pytest.approx(5.196, abs=1e-3))
    steady = air.steady(np.array([0.0, 15.0, 60.0, 90.0]), np.zeros(4))
    assert np.allclose(np.hypot(*steady[:, :2].T), [0.0, 3.0, 6.0, 6.0])
    assert np.all(profile(np.array([1.0, 80.0]), 0.0) == 1.0)


def test_turbulence_has_its_variance_and_its_memory():
    time = 1.5
    x = turbulence(np.random.default_rng(5), 3_000_000, 0.8, time)
    assert x.std() == pytest.approx(0.8, rel=0.1)
    lag = round(time / DT)
    correlation = np.mean(x[lag:] * x[:-lag]) / np.mean(x**2)
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.1)


def test_a_shorter_gusty_flight_is_the_start_of_a_longer_one():
    short, long = (Air(turbulence=1.0, seed=2).unsteady(n) for n in (20_000, 50_000))
    assert np.abs(short - long[:20_000]).max() < 1e-9


def test_density_of_the_standard_atmosphere():
    assert density(np.array([0.0, 1000.0, 5000.0])) == pytest.approx(
        [1.225, 1.1117, 0.7364], rel=1e-3
    )


def test_drag_tilts_into_the_wind_in_hover():
    still = fly(Airframe(), Air(north=5.0), 45.0)
    hover = aloft(still)
    slow = np.linalg.norm(still.v_n[hover], axis=1) < 0.3
    pitch = rotation.to_euler(still.R_nb[hover])
    lean = -still.R_nb[hover][slow][:, :2, 2]  # where the thrust points over ground
    assert slow.sum() > 1000
    assert lean[:, 0].max() < -np.tan(np.radians(5.0)) + 0.05
    assert np.all(np.isfinite(pitch))


def test_dropping_a_payload_lessens_the_thrust():
    frame = Airframe(payload=0.5, payload_until=25.0)
    flight = fly(frame, Air(), 45.0)
    force = flight.outputs.thrust_b + flight.outputs.drag_b
    for row, mass in ((24_000, 3.5), (26_000, 3.0)):
        assert force[row] == pytest.approx(mass * flight.f_b[row], abs=1e-9)


def test_planes_fly_at_the_angle_that_gives_their_lift(plane):
    inside = aloft(plane)
    u_b = rotation.rotate_back(plane.R_nb, plane.v_n - plane.outputs.wind_n)[inside]
    alpha = np.arctan2(u_b[:, 2], u_b[:, 0])
    pressure = 0.5 * plane.outputs.density[inside] * np.sum(u_b**2, axis=1)
    lift, drag = Wing(c_drag_p=0.13).coefficients(alpha)
    expected = -0.45 * pressure * (drag * np.sin(alpha) + lift * np.cos(alpha))
    assert np.abs(plane.outputs.drag_b[inside, 2] - expected).max() < 1e-9


@pytest.mark.parametrize("c_y_b", [-0.25, -0.49])
def test_planes_with_little_side_force_fly_what_they_are_told(c_y_b):
    """The rudder that holds a slip takes all of its force: lift that leans makes the rest."""
    wing = Wing(c_y_b=c_y_b)
    flight = fly(wing, Air(), 95.0, seed=5)
    inside = aloft(flight)
    outputs = flight.outputs
    missing = outputs.mass[:, None] * flight.f_b - outputs.thrust_b - outputs.drag_b
    assert np.abs(missing[inside]).max() < 1e-9
    u_b = rotation.rotate_back(flight.R_nb, flight.v_n)[inside]
    slip = np.arctan2(u_b[:, 1], u_b[:, 0])
    assert 0.05 < np.abs(slip).max() < 0.3
    assert np.abs(flight.w_b[inside]).max() < 4.0


def test_a_rudder_that_can_hold_a_large_slip_holds_it():
    """Aerobatic planes fly on their side; nothing but the rudder's end limits the slip."""
    n = 20_000
    t = np.arange(n) * DT
    slip = 0.6 * np.sin(0.4 * t)
    v_n = np.column_stack([np.full(n, 15.0), np.zeros(n), np.full(n, -1.0)])
    told = Motion(v_n, np.zeros(n), np.zeros(n), slip, np.ones(n, bool), np.zeros(n, bool), Start())
    flight = flown(told, Wing(c_n_deltar=0.4, c_y_deltar=-0.8), Air(), HOME)
    middle = slice(6000, 14_000)
    u_b = rotation.rotate_back(flight.R_nb, flight.v_n)[middle]
    assert np.arctan2(u_b[:, 1], u_b[:, 0]) == pytest.approx(slip[middle], abs=0.03)
    outputs = flight.outputs
    missing = outputs.mass[:, None] * flight.f_b - outputs.thrust_b - outputs.drag_b
    assert np.abs(missing[middle]).max() < 1e-9


def test_a_push_over_without_lift_does_not_roll_the_plane_over():
    n = 20_000
    t = np.arange(n) * DT
    down = 12.0 * np.sin(0.9 * t)  # its slope takes the lift through zero
    v_n = np.column_stack([np.full(n, 30.0), 0.3 * np.sin(2.0 * t), down])
    told = Motion(
        v_n, np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n, bool), np.zeros(n, bool), Start()
    )
    flight = flown(told, Wing(), Air(), HOME)
    middle = slice(6000, 14_000)
    assert flight.f_b[middle, 2].max() > -0.5
    assert np.abs(flight.w_b[middle, 0]).max() < 3.0


def test_a_nose_in_gusts_stays_where_it_was_turned_to():
    calm, gusty = (fly(Wing(), Air(turbulence=s, seed=5), 60.0) for s in (0.0, 0.6))
    inside = aloft(calm)
    heading, other = (rotation.to_euler(f.R_nb[inside])[:, 2] for f in (calm, gusty))
    turned = np.arctan2(np.sin(other - heading), np.cos(other - heading))
    gust = gusty.outputs.wind_n[inside, 1] / 20.0
    assert np.std(np.diff(turned[::100])) < 0.5 * np.std(np.diff(gust[::100]))


def test_an_airspeed_sensor_errs_by_the_root_of_its_ratio():
    right, wrong = (fly(Wing(airspeed_ratio=r), Air(), 60.0) for r in (2.0, 2.5))
    inside = aloft(right)
    ratio = wrong.outputs.indicated[inside].mean() / right.outputs.indicated[inside].mean()
    assert ratio == pytest.approx(np.sqrt(2.0 / 2.5), rel=2e-3)


def test_frame_and_coefficient_files_come_back(tmp_path):
    for craft, kind in (
        (HEAVY, Airframe),
        (Airframe(motor_lag=0.05), Airframe),
        (Wing(b=2.0), Wing),
    ):
        path = tmp_path / "craft.json"
        craft.save(path)
        assert kind.load(path) == craft
    assert set(Airframe().as_dict()) >= {"mass", "refSpd", "mdrag_coef", "num_motors", "slew_max"}
    assert "motor3_vector" in HEAVY.as_dict()
    assert not {"motor_lag", "payload"} & set(Airframe().as_dict())


def test_the_generator_knows_nothing_of_the_estimator():
    code = (
        "import sys, sitl.again, sitl.recording\n"
        "print([m for m in sys.modules if m.startswith('onboard.core')])"
    )
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
