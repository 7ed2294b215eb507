"""Errors put into recordings do what physics says they do, and nothing else."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real import concealed, concealed_attitude, concealed_fixes, concealed_force
from benchmarks.real.conceal import alike
from benchmarks.real.concealed_attitude import from_angles
from benchmarks.real.concealed_kind import About, Kind, about
from benchmarks.real.concealed_response import weighed
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ParameterValue, Sample
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep

G = 9.80665
LATE_S = 0.12
RATE = np.array([0.3, -0.2, 0.5])
OMEGA, RADIUS = 0.4, 20.0


def circle(t: float) -> tuple[float, float]:
    """North and east velocity on a circle, m/s."""
    return RADIUS * OMEGA * float(np.cos(OMEGA * t)), RADIUS * OMEGA * float(np.sin(OMEGA * t))


def angles(t: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw of some tumbling, rad."""
    return 0.4 * float(np.sin(t)), 0.3 * float(np.cos(0.7 * t)), 0.5 * t


def rate(t: float, step: float = 1e-4) -> np.ndarray:
    """Body rates from the attitude itself, rad/s."""
    S = from_angles(*angles(t - step)).T @ from_angles(*angles(t + step))
    return np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]]) / (4 * step)


def flight(*, scale: float = 0.98, offset: float = 0.2) -> list[Sample]:
    """Twenty seconds: two accelerometers at 50 Hz, attitude at 50 Hz, GPS at 5 Hz."""
    out: list[Sample] = [ParameterValue(f"INS_ACCSCAL_{a}", scale) for a in "XYZ"]
    out += [ParameterValue(f"INS_ACCOFFS_{a}", offset) for a in "XYZ"]
    for k in range(1000):
        t = 100.0 + k / 50
        w = tuple(rate(t).tolist())
        f = (0.5, -0.3, -G + 0.1 * float(np.sin(t)))
        out += [ImuSample(t, imu, f, w, 20.0 + 0.5 * (t - 100.0)) for imu in (1, 2)]
        out.append(AttitudeSample(t, *angles(t)))
        if k % 10 == 0:
            v_n, v_e = circle(t - LATE_S)
            out.append(
                GpsFix(t, 1, 3, 0.8, 0.1, 50.0, v_n, v_e, 0.0, t_receiver=t, t_message=t - 0.01)
            )
    return out


SAMPLES = flight()
GROUND = replace(about(SAMPLES, 1), late=LATE_S)


def laid(kind: Kind, samples: Sequence[Sample] = SAMPLES, ground: About = GROUND) -> list[Sample]:
    return list(kind.lay(samples, ground))


def forces(samples: Sequence[Sample], imu: int = 1) -> np.ndarray:
    return np.array([s.f_b for s in samples if isinstance(s, ImuSample) and s.imu == imu])


def times(samples: Sequence[Sample]) -> np.ndarray:
    return np.array([s.t for s in samples if isinstance(s, ImuSample) and s.imu == 1])


def fixes(samples: Sequence[Sample]) -> list[GpsFix]:
    return [s for s in samples if isinstance(s, GpsFix)]


def test_what_a_flight_says_of_itself() -> None:
    assert GROUND.in_force == pytest.approx([0.98] * 3 + [0.2] * 3)
    assert GROUND.start == 100.0
    assert GROUND.moment == pytest.approx(109.9)
    assert GROUND.fix_step == pytest.approx(0.2)
    assert GROUND.warms_by == pytest.approx(9.9, abs=0.1)


def test_a_flight_that_does_not_move_is_refused() -> None:
    still = [replace(s, v_n=0.0, v_e=0.0) if isinstance(s, GpsFix) else s for s in SAMPLES]
    with pytest.raises(ValueError, match="no moving flight"):
        about(still, 1)


@pytest.mark.parametrize("kind", concealed.KINDS, ids=lambda k: k.name)
def test_no_error_loses_adds_or_touches_what_is_not_its_own(kind: Kind) -> None:
    made = laid(kind)
    assert len(made) == len(SAMPLES)
    np.testing.assert_array_equal(forces(made, 2), forces(SAMPLES, 2))
    assert [s for s in made if isinstance(s, ParameterValue)] == [
        s for s in SAMPLES if isinstance(s, ParameterValue)
    ]
    changed = {type(s) for s in set(made) - set(SAMPLES)}
    assert len(changed) == 1


def test_kinds_have_names_of_their_own() -> None:
    assert len({k.name for k in concealed.KINDS}) == len(concealed.KINDS) >= 20


def test_a_step_of_half_in_x_changes_what_comes_after_it_only() -> None:
    difference = forces(laid(concealed_force.step(0, 0.5))) - forces(SAMPLES)
    after = times(SAMPLES) >= GROUND.moment
    assert 0 < after.sum() < len(after)
    np.testing.assert_allclose(difference[after], [[0.5, 0.0, 0.0]] * int(after.sum()), atol=1e-12)
    np.testing.assert_array_equal(difference[~after], 0.0)


def test_a_sensor_with_the_true_six_reads_the_force_again() -> None:
    """Truth about offset and scale: corrected with it, the changed reading is the old one."""
    old = np.array([1.01, 0.99, 1.02, 0.1, -0.2, 0.3])
    names = [f"{a} {what}" for what in ("scale", "offset") for a in "xyz"]
    before = dict(zip(names, old.tolist(), strict=True))
    in_force = GROUND.in_force
    for kind in (
        concealed_force.offset(1, -0.3),
        concealed_force.scale(2, 1.05),
        concealed_force.scale(0, 0.97),
    ):
        true = {**before, **kind.truth(before, GROUND)}
        new = np.array([true[n] for n in names])
        raw_old = forces(SAMPLES) / in_force[:3] + in_force[3:]
        raw_new = forces(laid(kind)) / in_force[:3] + in_force[3:]
        np.testing.assert_allclose(
            new[:3] * (raw_new - new[3:]), old[:3] * (raw_old - old[3:]), atol=1e-12
        )


def test_a_temperature_law_follows_the_temperature() -> None:
    difference = (forces(laid(concealed_force.warmed(0, 0.05))) - forces(SAMPLES))[:, 0]
    slope = np.polyfit(times(SAMPLES), difference, 1)[0]
    assert slope == pytest.approx(0.05 * 0.5)
    assert difference[0] == pytest.approx(0.05 * (20.0 - 35.0))


def test_a_flight_that_stays_as_cold_shows_no_law() -> None:
    assert concealed_force.warmed(0, 0.05).applies(GROUND)
    assert not concealed_force.warmed(0, 0.05).applies(replace(GROUND, warms_by=1.0))


def test_a_turned_accelerometer_reads_the_same_length() -> None:
    made = forces(laid(concealed_force.turned(0.05)))
    np.testing.assert_allclose(
        np.linalg.norm(made, axis=1), np.linalg.norm(forces(SAMPLES), axis=1)
    )
    # Turned right side down, it sees a level force (up) lean to its left.
    assert float(np.mean(made[:, 1] - forces(SAMPLES)[:, 1])) == pytest.approx(-0.05 * G, rel=0.05)


def test_latency_shifts_stamps_and_nothing_else() -> None:
    made = fixes(laid(concealed_fixes.latency(0.06)))
    for old, new in zip(fixes(SAMPLES), made, strict=True):
        assert new.t - old.t == pytest.approx(0.06)
        assert (new.t_message or 0.0) - (old.t_message or 0.0) == pytest.approx(0.06)
        assert replace(new, t=old.t, t_message=old.t_message) == old


def test_what_is_stamped_later_arrives_later() -> None:
    for kind in (concealed_fixes.latency(0.1), concealed_fixes.skewed(5e-4)):
        newest = -np.inf
        for s in laid(kind):
            if isinstance(s, ImuSample):
                newest = s.t
            elif isinstance(s, GpsFix):
                assert s.t >= newest


def test_a_clock_that_runs_away_is_right_at_the_start() -> None:
    old, new = fixes(SAMPLES), fixes(laid(concealed_fixes.skewed(5e-4)))
    assert new[0].t == old[0].t
    assert new[-1].t - old[-1].t == pytest.approx(5e-4 * (old[-1].t - 100.0))


def test_the_mean_of_two_fixes_is_late_by_half_and_as_smooth_as_its_span() -> None:
    """On a circle an average over a span w is shorter by 1 - (omega w)^2 / 24."""
    kind = concealed_fixes.averaged()
    before = {"gps_delay": LATE_S, "window_squared": 0.0}
    true = kind.truth(before, GROUND)
    for fix in fixes(laid(kind))[1:]:
        v = complex(fix.v_n, fix.v_e)
        ideal = complex(*circle(fix.t - true["gps_delay"]))
        shorter = 1.0 - OMEGA**2 * true["window_squared"] / 24.0
        assert v == pytest.approx(shorter * ideal, abs=1e-4)


def test_a_lever_arm_is_the_derivative_of_where_the_antenna_is() -> None:
    """Velocity against finite differences of ``R r``: no formula of rotation rates."""
    arm = np.array([0.5, 0.0, 0.0])
    made = fixes(laid(concealed_fixes.antenna(0, 0.5)))
    for old, new in zip(fixes(SAMPLES)[2:-2], made[2:-2], strict=True):
        gained = np.array([new.v_n - old.v_n, new.v_e - old.v_e, (new.v_d or 0) - (old.v_d or 0)])
        t, h = old.t - LATE_S, 1e-3
        there, then = (from_angles(*angles(t + s)) @ arm for s in (h, -h))
        np.testing.assert_allclose(gained, (there - then) / (2 * h), atol=2e-3)
        assert old.altitude - new.altitude == pytest.approx(
            float((from_angles(*angles(t)) @ arm)[2]), abs=1e-3
        )


def test_a_receiver_that_averages_averages_the_arm_as_well() -> None:
    ground = replace(GROUND, response=weighed(0.3, (0.0, 0.0, 0.0, 0.0), 0.2))
    made = fixes(laid(concealed_fixes.antenna(2, -0.4), ground=ground))
    arm = np.array([0.0, 0.0, -0.4])
    for old, new in zip(fixes(SAMPLES)[2:-2], made[2:-2], strict=True):
        ends = [from_angles(*angles(old.t - LATE_S + s)) @ arm for s in (-0.15, 0.15)]
        assert new.v_n - old.v_n == pytest.approx(float((ends[1] - ends[0])[0]) / 0.3, abs=5e-3)


@pytest.mark.parametrize(
    "shares",
    [
        (0.0,) * 4,
        (1.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 1.0),
        (0.3, 0.1, -0.5, 0.4),
    ],
)
def test_every_shape_spreads_as_the_span_says_about_its_mean(shares: tuple[float, ...]) -> None:
    moments, weights = weighed(0.4, shares, 0.2)
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ moments == pytest.approx(0.0, abs=1e-9)
    assert weights @ moments**2 == pytest.approx(0.4**2 / 12.0, rel=2e-3)


def test_newer_moments_weigh_more_in_the_shape_that_says_so() -> None:
    moments, weights = weighed(0.2, (1.0, 0.0, 0.0, 0.0), 0.2)
    assert weights[np.argmax(moments)] > 0.5
    assert np.ptp(moments) == pytest.approx(0.2)
    lagging = weighed(0.2, (0.0, 0.0, 0.0, 1.0), 0.2)[0]
    assert abs(lagging.min()) > 1.5 * lagging.max()  # what is long ago has a tail


def test_an_antenna_swings_with_the_heading_that_the_flight_has() -> None:
    """A recorded heading that is off turns what is recorded, not where the antenna is."""
    off = [replace(s, yaw=s.yaw + 0.5) if isinstance(s, AttitudeSample) else s for s in SAMPLES]
    at = np.array([s.t for s in SAMPLES if isinstance(s, AttitudeSample)])
    true = np.array([s.yaw for s in SAMPLES if isinstance(s, AttitudeSample)])
    ground = replace(GROUND, heading=np.array([at, true]))
    kind = concealed_fixes.antenna(0, 0.5)
    straight, turned = fixes(laid(kind)), fixes(laid(kind, off, ground))
    for a, b in zip(straight[2:-2], turned[2:-2], strict=True):
        assert (a.v_n, a.v_e) == pytest.approx((b.v_n, b.v_e), abs=1e-6)


def test_a_fault_lasts_ten_seconds() -> None:
    off = [
        (n.t, n.v_n - o.v_n)
        for o, n in zip(fixes(SAMPLES), fixes(laid(concealed_fixes.fault(3.0))), strict=True)
        if n.v_n != o.v_n
    ]
    assert all(v == pytest.approx(3.0) for _, v in off)
    assert GROUND.moment <= off[0][0]
    assert off[-1][0] < GROUND.moment + concealed_fixes.FAULT_S


def test_heading_and_tilt_turn_about_down_and_about_the_body() -> None:
    for old, new in zip(
        (s for s in SAMPLES if isinstance(s, AttitudeSample)),
        (s for s in laid(concealed_attitude.heading(0.1)) if isinstance(s, AttitudeSample)),
        strict=True,
    ):
        R = from_angles(new.roll, new.pitch, new.yaw) @ from_angles(*angles(old.t)).T
        np.testing.assert_allclose(R, from_angles(0.0, 0.0, 0.1), atol=1e-12)
    for old, new in zip(
        (s for s in SAMPLES if isinstance(s, AttitudeSample)),
        (s for s in laid(concealed_attitude.tilted(0.05)) if isinstance(s, AttitudeSample)),
        strict=True,
    ):
        R = from_angles(*angles(old.t)).T @ from_angles(new.roll, new.pitch, new.yaw)
        np.testing.assert_allclose(R, from_angles(0.05, 0.0, 0.0), atol=1e-12)


def test_a_jump_at_another_moment_is_another_jump() -> None:
    jump = BiasStep(Origin(0.0)).at(50.0, sigma=0.5)
    assert alike(jump, BiasStep(Origin(0.0)).at(51.0, sigma=0.5))
    assert not alike(jump, BiasStep(Origin(0.0)).at(66.0, sigma=0.2))
