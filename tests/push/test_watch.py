from dataclasses import replace

import numpy as np
import pytest

from onboard.push.entries import Planned, Verdict
from onboard.push.plan import propose
from onboard.push.signals import VehicleReport
from onboard.push.watch import PushWatch, WatchSettings
from tests.autopilot_parameters import float32
from tests.push.calibrations import OFFSET, SCALE, calibration, current

PUSHED = Planned("t", propose(calibration(), current(), system_id=1))


def flown(**changes):
    """The flight after: the pushed values are in force and fit as predicted."""
    defaults = {
        "in_force_scale": tuple(float32(v) for v in SCALE),
        "in_force_offset": tuple(float32(v) for v in OFFSET),
        "held_out_before": 1.0,
        "held_out_after": 1.0,
        "velocity_rms_before": 0.05,
    }
    return calibration(**(defaults | changes))


def verdict(**changes):
    said = PushWatch(PUSHED).judge(flown(**changes))
    assert said is None or (said.transaction == "t" and said.sentence)
    return said and said.verdict


def truth_is(old):
    """The new flight's own estimate: at the old values, or where the push put them."""
    plan = PUSHED.plan
    six = plan.six_before() if old else plan.six_wanted()
    return {"scale": six.scale, "offset": six.offset}


def test_better_is_kept():
    assert verdict() is Verdict.KEPT


@pytest.mark.parametrize(("residual", "expected"), [(2.2, Verdict.DOUBTED), (2.4, Verdict.WORSE)])
def test_limit_is_the_residual_before_the_push_and_a_tenth(residual, expected):
    between = {
        "scale": tuple((np.array(SCALE) + 1.0) / 2),
        "offset": tuple((np.array(OFFSET) + np.array((0.02, -0.03, 0.04))) / 2),
    }
    assert verdict(held_out_before=residual, **between) is expected


def test_old_values_that_fit_the_new_flight_better_are_worse_for_the_push():
    assert verdict(**truth_is(old=True)) is Verdict.WORSE


def test_what_the_flight_measured_is_told_with_the_verdict():
    said = PushWatch(PUSHED).judge(flown(held_out_before=1.02, velocity_rms_before=0.06))
    assert (said.held_out, said.velocity_rms) == (1.02, 0.06)


def test_a_flight_with_other_values_measured_nothing_of_the_pushed():
    said = PushWatch(PUSHED).judge(flown(in_force_scale=(1.1, 1.1, 1.1)))
    assert said.verdict is Verdict.SUPERSEDED
    assert (said.held_out, said.velocity_rms) == (None, None)


def test_rough_flight_alone_is_no_reason_to_go_back():
    said = PushWatch(PUSHED).judge(flown(held_out_before=5.0, **truth_is(old=False)))
    assert said.verdict is Verdict.KEPT
    assert "5" in said.sentence


def jumped(x_offset, **changes):
    """A flight of a sensor whose x offset has changed since the push."""
    six = PUSHED.plan.six_wanted()
    offset = (six.offset[0] + x_offset, *six.offset[1:])
    return flown(scale=six.scale, offset=offset, held_out_before=1.9, **changes)


def test_a_flight_that_is_not_what_was_promised_is_no_confirmation():
    said = PushWatch(PUSHED).judge(jumped(0.1))
    assert said.verdict is Verdict.DOUBTED
    assert said.sentence.startswith("kept, but this flight does not fit what was written: ")
    assert "1.9, 1.05 was promised" in said.sentence
    assert said.held_out == 1.9


def test_what_both_uncertainties_leave_room_for_is_no_doubt():
    """By the 0.999 quantile: of flights that differ by chance one in a thousand is doubted."""
    both = np.sqrt(PUSHED.plan.changes[3].sigma ** 2 + calibration().with_its_gyroscope[3, 3])
    for sigmas, expected in ((4.7, Verdict.KEPT), (4.8, Verdict.DOUBTED)):  # 22.46 = 4.74**2
        assert PushWatch(PUSHED).judge(jumped(sigmas * both)).verdict is expected


def test_flights_that_differ_by_chance_are_doubted_as_seldom_as_is_said():
    rng = np.random.default_rng(3)
    P = calibration().with_its_gyroscope
    sigma = np.array([c.sigma for c in PUSHED.plan.changes])
    L = np.linalg.cholesky(P + np.diag(sigma**2))
    wanted = PUSHED.plan.six_wanted().as_vector()
    doubted = 0
    for _ in range(2000):
        x = wanted + L @ rng.normal(size=6)
        cal = flown(scale=tuple(x[:3]), offset=tuple(x[3:]), held_out_before=1.9)
        doubted += PushWatch(PUSHED).judge(cal).verdict is Verdict.DOUBTED
    assert doubted <= 8  # 2 are expected; more than 8 in one of 4000 draws


@pytest.mark.parametrize("change", [{"held_out_before": 1.1}, {"covariance": ((np.nan,) * 6,) * 6}])
def test_without_a_larger_residual_or_without_sigmas_nothing_is_doubted(change):
    cal = replace(jumped(0.1), **change)
    assert PushWatch(PUSHED).judge(cal).verdict is Verdict.KEPT


def test_old_values_that_fit_better_still_take_it_back():
    assert verdict(held_out_before=1.9, **truth_is(old=True)) is Verdict.WORSE


def test_difference_of_the_residual_sums_is_that_of_the_linear_model():
    """J = |A p - y|^2 computed on rows, against the parabola that the watch uses."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(200, 6)) * np.array([500.0] * 3 + [60.0] * 3)
    old, new = PUSHED.plan.six_before().as_vector(), PUSHED.plan.six_wanted().as_vector()
    for mix in (0.46, 0.5, 0.54):
        y = A @ (mix * old + (1 - mix) * new) + rng.normal(size=200)
        x = np.linalg.lstsq(A, y, rcond=None)[0]
        P = np.linalg.inv(A.T @ A)
        difference = np.sum((A @ old - y) ** 2) - np.sum((A @ new - y) ** 2)
        cal = flown(
            scale=tuple(x[:3]),
            offset=tuple(x[3:]),
            covariance=tuple(map(tuple, P)),
            held_out_before=1.0,
        )
        for evidence in (0.99, 1.01):
            watch = PushWatch(PUSHED, WatchSettings(evidence=abs(difference) * evidence))
            clear = watch.judge(cal).verdict is Verdict.WORSE
            assert clear == (difference < 0 and evidence < 1)


def test_velocity_where_there_is_nothing_whitened():
    nan = float("nan")
    unknown = {"held_out_before": nan, "covariance": ((nan,) * 6,) * 6}
    assert verdict(velocity_rms_before=0.5, **unknown) is Verdict.KEPT
    assert verdict(velocity_rms_before=0.6, **unknown) is Verdict.WORSE
    assert verdict(velocity_rms_before=nan, **unknown) is None


@pytest.mark.parametrize("change", [{"trusted_s": 59.0}, {"parameters_known": False}, {"imu": 2}])
def test_too_little_to_judge(change):
    assert verdict(**change) is None


def test_somebody_elses_parameters_are_not_judged():
    assert verdict(in_force_offset=(0.5, 0.0, 0.0)) is Verdict.SUPERSEDED


class TestInFlight:
    BAD = VehicleReport(armed=True, ekf_healthy=False)

    def test_ekf_that_falls_ill_after_it_takes_it_back(self):
        watch = PushWatch(PUSHED, in_flight_since=100.0)
        assert watch.vehicle(replace(self.BAD, ekf_healthy=True), 101.0) is None
        assert watch.vehicle(replace(self.BAD, ekf_healthy=None), 102.0) is None
        assert watch.vehicle(self.BAD, 110.0).verdict is Verdict.WORSE

    def test_later_or_on_the_ground_it_has_other_causes(self):
        assert PushWatch(PUSHED, in_flight_since=100.0).vehicle(self.BAD, 131.0) is None
        assert PushWatch(PUSHED).vehicle(self.BAD, 1.0) is None


def test_way_back_is_the_plan_reversed():
    back = PushWatch(PUSHED).plan.reversed()
    assert back.wanted == PUSHED.plan.before
