"""Flights whose force is known, by formulas written apart from the product's."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.frames import rotation_from_euler
from onboard.core.vehicle.flight import Flight

G = 9.80665
STEP = 0.1


def assert_derivatives(model):
    """A model's derivatives are those of its whole prediction, by central differences."""
    theta = model.nominal + 0.05 * model.plausible
    ours = model.jacobian(theta).whole
    for j, size in enumerate(model.plausible):
        step = np.zeros(len(theta))
        step[j] = 1e-3 * size
        apart = model.predicted(theta + step) - model.predicted(theta - step)
        np.testing.assert_allclose(ours[:, :, j], apart / (2e-3 * size), atol=1e-9)


def smooth(rng, n, scale, correlation_s=2.0):
    """(n,) a smooth random signal of this standard deviation."""
    width = int(4 * correlation_s / STEP)
    kernel = np.hanning(2 * width + 1)
    x = np.convolve(rng.normal(size=n + 2 * width), kernel, mode="valid")
    return scale * x / x.std()


def flight_with(t, R, v_n, height, f_b, *, commands=None, volts=None, airspeed=None, ground=580.0):
    n = len(t)
    R_bn = np.swapaxes(R, -1, -2)
    battery = np.zeros((n, 0)) if volts is None else np.stack([volts, np.full(n, 10.0)], axis=1)
    return Flight(
        t=t,
        piece=np.zeros(n, dtype=np.int64),
        f_b=f_b,
        w_b=np.zeros((n, 3)),
        R_bn=R_bn,
        v_b=np.einsum("nij,nj->ni", R_bn, v_n),
        v_n=v_n,
        height=height,
        ground=ground,
        rho=1.225 * (1 - 0.0065 * height / 288.15) ** 4.2559,
        outputs=np.zeros((n, 0)),
        commands=np.zeros((n, 0)) if commands is None else commands,
        battery=battery,
        airspeed=np.full(n, np.nan) if airspeed is None else airspeed,
        ekf_wind=np.zeros((n, 0)),
        velocity_sigma=0.01,
        attitude_sigma=np.full(3, 1e-3),
    )


def copter_flight(
    *,
    seed=1,
    seconds=240.0,
    wind=(0.0, 0.0),
    exponent=0.0,
    c_m=0.24833,
    area=0.058108,
    tilt=(0.0, 0.0),
    ratio=1.0,
    expo=0.65,
    volts=None,
    sag=0.0,
    noise=0.01,
    still=False,
    lag=0.0,
    mass=None,
    weaker=None,
    turning=(0.0, 0.0),
    front=None,
    rougher=None,
    rising=0.0,
):
    """A copter that manoeuvres: four motors that share the thrust, thrust by a known command.

    The motors follow what is asked of them behind a low-pass of ``lag``, s.  ``mass`` and
    ``weaker`` are (moment, factor): from so many seconds on it, or the thrust, is so many times
    itself; so is the drag of a copter that gets ``rougher``.  The air is ``rising``, m/s.  The wind
    becomes another by twice ``turning``, at an even rate, about its mean; or at once, of a
    ``front`` (moment, by how much).
    """
    rng = np.random.default_rng(seed)
    n = int(seconds / STEP)
    t = 50.0 + STEP * np.arange(n)
    size = 0.0 if still else 1.0
    v_n = np.stack(
        [size * smooth(rng, n, 4.0), size * smooth(rng, n, 4.0), size * smooth(rng, n, 1.2)], axis=1
    )
    roll, pitch = size * smooth(rng, n, 0.2), size * smooth(rng, n, 0.2)
    yaw = size * 3.0 * smooth(rng, n, 1.0, 6.0)
    R = rotation_from_euler(roll, pitch, yaw)
    height = 620.0 + size * smooth(rng, n, 12.0, 8.0)
    above = np.clip(height - 580.0, 0.5, 60.0)
    factor = (above / np.clip(np.mean(height) - 580.0, 0.5, 60.0)) ** exponent
    w_n = np.zeros((n, 3))
    w_n[:, :2] = factor[:, None] * np.asarray(wind)
    w_n[:, :2] += np.linspace(-1.0, 1.0, n)[:, None] * np.asarray(turning)
    if front is not None:
        w_n[t - t[0] >= front[0], :2] += np.asarray(front[1])
    w_n[:, 2] -= rising
    u = np.einsum("nji,nj->ni", R, v_n - w_n)
    rho = 1.225 * (1 - 0.0065 * height / 288.15) ** 4.2559
    command = 0.6 + size * np.clip(smooth(rng, n, 0.06), -0.2, 0.2)
    power = (1 - expo) * command + expo * command**2
    voltage = np.full(n, 12.6) if volts is None else np.linspace(*volts, n)
    rho_ref = 1.225 * (1 - 0.0065 * 593.0 / 288.15) ** 4.2559
    outflow = 2 * 29.3 * 12.09 / (3.0 * G)
    heavy, strong, rough = (
        np.where(t - t[0] < of[0], 1.0, of[1]) if of else np.ones(n)
        for of in (mass, weaker, rougher)
    )
    thrust = ratio * G / 0.39 * rho / rho_ref * power * (voltage / 12.6) ** (2 * sag) * strong
    thrust = thrust - G / outflow**2 * rho / rho_ref * np.maximum(-u[:, 2], 0.0) ** 2
    linear = c_m * np.sqrt(rho / 1.225 * np.maximum(thrust, 0.5) / G)
    force = -linear[:, None] * u - 0.5 * (rho * area)[:, None] * np.abs(u) * u
    force *= rough[:, None]
    force[:, 0] += tilt[0] * thrust
    force[:, 1] += tilt[1] * thrust
    force[:, 2] -= thrust
    f_b = force / heavy[:, None]
    f_b = f_b + noise * np.stack([smooth(rng, n, 1.0, 1.0) for _ in range(3)], axis=1)
    asked = command + lag * np.gradient(command, STEP)
    commands = np.stack([asked, asked**2, np.ones(n)], axis=1)
    return flight_with(
        t, R, v_n, height, f_b, commands=commands, volts=None if volts is None else voltage
    )


def followed(commands, lag):
    """Commands (k, n) behind a low-pass of ``lag`` s; straight lines between the steps."""
    decay, late = np.exp(-STEP / lag), np.empty_like(commands)
    for row, command in zip(late, commands, strict=True):
        state = command[0]
        for k in range(len(command)):
            # The exact answer of a low-pass to a ramp.
            before = command[k - 1] if k else command[0]
            slope = (command[k] - before) / STEP
            state = decay * (state - before + slope * lag) + command[k] - slope * lag
            row[k] = state
    return late


def plane_flight(
    *,
    seed=1,
    seconds=180.0,
    wind=(0.0, 0.0),
    c_lift_0=0.56,
    c_lift_a=6.9,
    c_drag_p=0.1,
    c_y_b=-0.98,
    ratio=1.0,
    reading=None,
    lost=0.0,
    slip_drag=0.0,
    slip_straight=0.0,
    braking=1.0,
    bend=0.0,
    throttle_swing=0.15,
    heading_off=0.0,
    noise=0.05,
    gusts=0.0,
    rudder_by_slip=0.0,
    servo_lag=0.14,
    kicks=0.0,
    angles=0.02,
    turning=0.25,
    speeds=3.0,
    turned=0.0,
    front=None,
):
    """A plane in turns and climbs; airspeed as a right sensor would read times ``reading``.

    ``ratio`` of the thrust, ``lost`` of it by m/s that the propeller meets, a windmilling one's
    share of what that brakes, and the ``bend`` of that line at its end; drag by the square of
    sideslip and by sideslip itself; standard deviations of the throttle, of a slow error of the
    recorded heading, rad, of the force's noise, m/s^2, and of gusts along each axis that carry the
    plane along, so that it flies through them as through still air, m/s.  The rudder moves at
    random, and by the sideslip that it holds; or it is kicked this far to either side, and the
    plane slips as it does; ``angles`` is the standard deviation of the angle of attack.  Servos
    and motor follow behind a low-pass, s.  Standard deviations of the rate of turn and of the
    speed are ``turning``, rad/s, and ``speeds``, m/s; the recorded heading is ``turned`` too far
    all flight long, rad.  The wind becomes another at once, of a ``front`` (moment, by how much).
    """
    rng = np.random.default_rng(seed)
    n = int(seconds / STEP)
    t = 50.0 + STEP * np.arange(n)
    speed, yaw = 24.0 + smooth(rng, n, speeds, 4.0), np.cumsum(smooth(rng, n, turning, 5.0)) * STEP
    alpha, beta = -0.03 + smooth(rng, n, angles), smooth(rng, n, 0.03)
    pitch = smooth(rng, n, 0.1, 4.0)
    R = rotation_from_euler(smooth(rng, n, 0.4, 4.0), pitch, yaw)
    kicked = kicks * np.repeat(rng.integers(-1, 2, n // 30 + 1), 30)[None, :n] if kicks else None
    if kicked is not None:
        beta = 0.3 * beta + 0.3 * followed(kicked, servo_lag)[0]
    x = speed / np.sqrt(1 + np.tan(alpha) ** 2 + np.tan(beta) ** 2)
    u = np.stack([x, x * np.tan(beta), x * np.tan(alpha)], axis=1)
    v_n = np.einsum("nij,nj->ni", R, u) + np.array([*wind, 0.0])
    if front is not None:
        v_n[t - t[0] >= front[0], :2] += np.asarray(front[1])
    if gusts:
        v_n = v_n + np.stack([smooth(rng, n, gusts, 1.0) for _ in range(3)], axis=1)
    height = 700.0 + smooth(rng, n, 10.0, 8.0)
    rho = 1.225 * (1 - 0.0065 * height / 288.15) ** 4.2559
    q = 0.5 * rho * rho / 1.225 * speed**2 * 0.45 / 2.0
    lift = c_lift_0 + c_lift_a * alpha
    drag = c_drag_p + lift**2 / (np.pi * 0.9 * 1.88**2 / 0.45) + slip_drag * beta**2
    drag = drag + slip_straight * np.abs(beta)
    throttle = 0.5 + np.clip(smooth(rng, n, throttle_swing), -0.48, 0.48)
    rudder = smooth(rng, n, 0.15 if not rudder_by_slip else 0.02) + rudder_by_slip * beta
    rudder = rudder if kicked is None else kicked[0]
    late = followed(np.stack([throttle, rudder]), servo_lag)
    pull = ratio * late[0] - lost * np.sqrt(np.clip(late[0], 0.0, None)) * x
    pull = np.where(pull < 0.0, braking * pull, pull) - bend * (lost * x) ** 2
    f_b = np.stack(
        [
            G / 0.7 * pull + q * (lift * np.sin(alpha) - drag * np.cos(alpha)),
            q * (c_y_b * beta - 0.2 * late[1]),
            -q * (lift * np.cos(alpha) + drag * np.sin(alpha)),
        ],
        axis=1,
    )
    f_b = f_b + np.stack([smooth(rng, n, noise, 1.0) for _ in range(3)], axis=1)
    airspeed = None
    if reading is not None:
        airspeed = reading * speed * np.sqrt(rho / 1.225) + 0.2 * rng.normal(size=n)
    commands = np.stack([throttle, rudder], axis=1)
    if heading_off or turned:
        off = turned + (smooth(rng, n, heading_off, 15.0) if heading_off else np.zeros(n))
        zero = np.zeros(n)
        R = rotation_from_euler(zero, zero, off) @ R
    return flight_with(t, R, v_n, height, f_b, commands=commands, airspeed=airspeed)
