from dataclasses import replace

import pytest

from onboard.core.estimate.result import Status
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.daemon.setup.configuration import PushSettings
from onboard.daemon.setup.settings import policy_settings
from onboard.push.plan import propose
from onboard.push.policy import (
    ALLOWED,
    Accelerometer,
    Mode,
    Objection,
    PolicySettings,
    VehicleCondition,
    context_names,
    ekf_healthy,
    judge,
    moment,
)
from onboard.push.policy import objections as values_objections
from tests.push.calibrations import calibration, covariance, current

LANDED = VehicleCondition(armed=False, disarmed_for=6.0, landed=True)
HEALTHY = 0x001 | 0x002 | 0x004 | 0x008 | 0x010 | 0x020 | 0x100 | 0x200
FLYING = VehicleCondition(armed=True, landed=False, ekf_flags=HEALTHY)


def objections(cal=None, condition=LANDED, settings=None, values=None, others=(), **now):
    cal = cal or calibration()
    plan = propose(cal, current(cal.imu, **now), system_id=1)
    found = judge(plan, cal, condition, settings or PolicySettings(), values=values, others=others)
    for refusal in found:
        assert refusal.sentence
    return {r.objection for r in found}


def test_a_file_is_judged_by_the_limits_that_a_service_has_by_default():
    assert policy_settings(PushSettings()) == PolicySettings()


def test_objections_to_the_values_know_nothing_of_the_moment():
    cal = calibration()
    plan = propose(cal, current(), system_id=1)
    assert values_objections(plan, cal, PolicySettings(mode=Mode.NEVER)) == ()
    (said,) = values_objections(plan, cal, PolicySettings(), missing="the axes are not square")
    assert said.objection is Objection.PHYSICS_MISSING
    assert said.sentence == "physics missing: the axes are not square"


def test_good_calibration_of_a_landed_vehicle_may_be_written():
    assert objections() == set()


def test_nothing_but_thirty_accelerometer_names_is_ever_allowed():
    assert len(ALLOWED) == 30
    assert all(n.startswith("INS") and ("ACC" in n) and n[-1] in "XYZ" for n in ALLOWED)
    assert not any("ID" in n or "CALTEMP" in n for n in ALLOWED)


class TestMoment:
    @pytest.mark.parametrize(
        ("mode", "condition", "expected"),
        [
            (Mode.NEVER, LANDED, {Objection.NEVER}),
            (Mode.LANDED, VehicleCondition(), {Objection.STATE_UNKNOWN}),
            (Mode.LANDED, FLYING, {Objection.ARMED}),
            (Mode.LANDED, replace(LANDED, disarmed_for=4.9), {Objection.DISARMED_TOO_SHORT}),
            (Mode.LANDED, replace(LANDED, landed=False), {Objection.IN_AIR}),
            (Mode.LANDED, replace(LANDED, landed=None), set()),
            (Mode.IN_FLIGHT, LANDED, set()),
            (Mode.IN_FLIGHT, FLYING, set()),
            (Mode.IN_FLIGHT, replace(FLYING, ekf_flags=None), {Objection.EKF_UNHEALTHY}),
            (
                Mode.IN_FLIGHT,
                replace(FLYING, ekf_flags=HEALTHY | 0x8000),
                {Objection.EKF_UNHEALTHY},
            ),
        ],
    )
    def test_who_may_write_when(self, mode, condition, expected):
        found = moment(condition, PolicySettings(mode=mode))
        assert {r.objection for r in found} == expected

    @pytest.mark.parametrize("bit", [0x001, 0x002, 0x004, 0x010, 0x020])
    def test_each_needed_ekf_flag_is_needed(self, bit):
        assert ekf_healthy(HEALTHY)
        assert not ekf_healthy(HEALTHY & ~bit)

    @pytest.mark.parametrize("bit", [0x080, 0x400, 0x8000])
    def test_each_forbidden_ekf_flag_forbids(self, bit):
        assert not ekf_healthy(HEALTHY | bit)


class TestEstimate:
    @pytest.mark.parametrize("status", [s for s in Status if s is not Status.CALIBRATED])
    def test_only_calibrated(self, status):
        assert objections(calibration(status=status)) == {Objection.NOT_CALIBRATED}

    def test_raw_units_must_have_been_known(self):
        cal = calibration(parameters_known=False)
        assert objections(cal) == {Objection.PARAMETERS_UNKNOWN}

    @pytest.mark.parametrize(
        "changes",
        [
            {"predictive_gain": 4.6},
            {"predictive_gain": -10.0},
            {"predictive_gain": float("nan")},
            {"held_out_before": float("nan")},
        ],
    )
    def test_must_improve_what_it_has_not_seen(self, changes):
        assert objections(calibration(**changes)) == {Objection.NO_IMPROVEMENT}

    def test_must_be_better_for_sure(self):
        """As wide as this, the values in force may be as good."""
        sigmas = [0.014] * 3 + [0.12] * 3
        cal = calibration(
            covariance=covariance(sigmas),
            offset=(0.07, 0.0, 0.1),
            scale=(1.0, 1.0, 1.0),
        )
        assert objections(cal) == {Objection.NOT_SURE}
        # A correction that is ten times as large is sure, however wide it is.
        assert objections(replace(cal, offset=(1.2, -1.2, 1.2))) == set()

    def test_value_that_is_already_there_is_not_written_again(self):
        cal = calibration()
        assert objections(cal, scale=cal.scale, offset=cal.offset) == {Objection.NOTHING_TO_CHANGE}

    def test_unseen_number_is_left(self):
        sigmas = (0.001, 0.001, 0.03, 0.008, 0.008, 0.02)
        cal = calibration(covariance=covariance(sigmas))
        plan = propose(cal, current(), system_id=1)
        assert plan.changes[2].kept
        assert plan.wanted["INS_ACCSCAL_Z"] == 1.0
        assert plan.worth.directions == 5
        assert objections(cal) == set()

    def test_a_combination_is_set_where_its_numbers_are_not_known(self):
        """z scale and offset are only known together, at the load of level flight."""
        sigmas = (0.001, 0.001, 0.029, 0.008, 0.008, 0.285)
        cal = calibration(covariance=covariance(sigmas, [(2, 5, -0.999)]))
        plan = propose(cal, current(), system_id=1)
        assert not any(c.kept for c in plan.changes)
        assert plan.worth.directions == 5
        assert objections(cal) == set()

    def test_numbers_that_the_flight_contradicts_together_stop_everything(self):
        """Neither by itself, but both at once: a plan cannot leave them as they are."""
        sigmas = (0.001, 0.029, 0.029, 0.008, 0.008, 0.008)
        cal = calibration(
            scale=(1.013, 1.0 + 0.06, 1.0 - 0.06),
            covariance=covariance(sigmas, [(1, 2, 0.9)]),
        )
        assert Objection.CONTRADICTED in objections(cal)

    def test_of_numbers_that_lack_physics_nothing_more_is_said(self):
        """By how much they are wrong nobody knows, so they contradict nothing that is in force."""
        sigmas = (0.001, 0.029, 0.029, 0.008, 0.008, 0.008)
        cal = calibration(
            scale=(1.013, 1.0 + 0.06, 1.0 - 0.06),
            covariance=covariance(sigmas, [(1, 2, 0.9)]),
        )
        plan = propose(cal, current(), system_id=1)
        settings = PolicySettings()
        assert Objection.CONTRADICTED in {
            r.objection for r in values_objections(plan, cal, settings)
        }
        missing = {
            r.objection for r in values_objections(plan, cal, settings, missing="the offset jumped")
        }
        assert Objection.PHYSICS_MISSING in missing
        assert Objection.CONTRADICTED not in missing

    def test_nothing_seen(self):
        cal = calibration(
            scale=(1.0, 1.0, 1.0),
            offset=(0.02, -0.03, 0.04),
            covariance=covariance((0.029,) * 3 + (0.45,) * 3),
        )
        assert objections(cal) == {Objection.NOTHING_OBSERVED}


class TestBounds:
    @pytest.mark.parametrize("value", [0.79, 1.21])
    @pytest.mark.parametrize("i", range(3))
    def test_scale(self, value, i):
        scale = tuple(value if j == i else 1.01 for j in range(3))
        assert objections(calibration(scale=scale)) == {Objection.OUT_OF_BOUNDS}

    @pytest.mark.parametrize("value", [-3.51, 3.51])
    @pytest.mark.parametrize("i", range(3))
    def test_offset(self, value, i):
        offset = tuple(value if j == i else 0.1 for j in range(3))
        assert objections(calibration(offset=offset)) == {Objection.OUT_OF_BOUNDS}

    def test_three_zero_offsets(self):
        assert objections(calibration(scale=(1.03, 0.97, 1.03), offset=(0.0, 0.0, 0.0))) == {
            Objection.ZERO_OFFSETS
        }

    def test_old_value_out_of_bounds_that_stays_is_not_ours_to_judge(self):
        cal = calibration(
            observable=(False, True, True, True, True, True),
            covariance=covariance((0.2, 0.001, 0.002, 0.008, 0.008, 0.02)),
        )
        assert objections(cal, scale=(1.3, 1.0, 1.0)) == set()

    @pytest.mark.parametrize(
        ("now", "refused"),
        [
            ({"scale": (0.5, 1.0, 1.0)}, True),
            ({"scale": (-1.0, 1.0, 1.0)}, True),
            ({"scale": (0.0, 0.0, 0.0)}, False),  # ArduPilot takes that for none
            ({"offset": (0.1, -30.0, 0.1)}, True),
            ({"offset": (0.1, -9.0, 0.1)}, False),  # its own calibration accepts as much
        ],
    )
    def test_nothing_is_written_over_what_would_never_be_written_back(self, now, refused):
        assert (Objection.NO_WAY_BACK in objections(**now)) is refused


class TestInFlight:
    SETTINGS = PolicySettings(mode=Mode.IN_FLIGHT)

    def test_large_step_waits_for_the_ground(self):
        assert objections(condition=FLYING, settings=self.SETTINGS) == {Objection.STEP_TOO_LARGE}
        assert objections(condition=LANDED, settings=self.SETTINGS) == set()

    def test_small_step_may_be_made(self):
        cal = calibration(scale=(1.004, 1.0, 1.0), offset=(0.06, -0.03, 0.04))
        assert objections(cal, FLYING, self.SETTINGS) == set()


class TestTemperature:
    ENABLE, CALTEMP, _ = context_names(1)

    @pytest.mark.parametrize(
        ("values", "expected"),
        [
            ({}, set()),
            ({ENABLE: 0.0}, set()),
            ({ENABLE: 1.0, CALTEMP: 35.0}, set()),
            ({ENABLE: 1.0}, {Objection.TEMPERATURE_REFERENCE}),
            ({ENABLE: 1.0, CALTEMP: -300.0}, {Objection.TEMPERATURE_REFERENCE}),
            ({ENABLE: 2.0, CALTEMP: 35.0}, {Objection.TEMPERATURE_LEARNING}),
        ],
    )
    def test_calibration_of_temperature(self, values, expected):
        assert objections(values=values) == expected

    def test_names_of_later_instances(self):
        assert context_names(2)[:2] == ("INS_TCAL2_ENABLE", "INS_ACC2_CALTEMP")
        assert context_names(4)[:2] == ("INS4_TCAL_ENABLE", "INS4_ACC_CALTEMP")


class TestConsistency:
    """IMU 1 is written; IMU 2 stays as it is, wrong by some offset."""

    def other(self, wrong, imu=2, axis=0):
        truth = SixParameters((1.0,) * 3, (0.1, 0.1, 0.1))
        offset = tuple(0.1 + (wrong if i == axis else 0.0) for i in range(3))
        return Accelerometer(imu, truth, SixParameters((1.0,) * 3, offset))

    @pytest.mark.parametrize(
        ("wrong", "imu", "axis", "refused"),
        [
            (0.74, 2, 0, False),
            (0.76, 2, 0, True),
            (0.76, 2, 2, False),  # z counts half
            (1.52, 2, 2, True),
            (2.2, 3, 0, False),  # the third may differ by three times as much
            (2.3, 3, 0, True),
        ],
    )
    def test_arming_would_fail(self, wrong, imu, axis, refused):
        # IMU 1 is wrong the same way now, so that the two agree before the push.
        now = {"offset": tuple(0.15 + (wrong if i == axis else 0.0) for i in range(3))}
        cal = calibration(scale=(1.0,) * 3, offset=(0.15,) * 3)
        found = objections(cal, others=[self.other(wrong, imu, axis)], **now)
        assert found == ({Objection.IMUS_INCONSISTENT} if refused else set())

    def test_threshold_is_the_autopilots_own(self):
        now = {"offset": (0.65, 0.15, 0.15)}
        cal = calibration(scale=(1.0,) * 3, offset=(0.15,) * 3)
        values = {"ARMING_ACCTHRESH": 0.4}
        assert objections(cal, others=[self.other(0.5)], values=values, **now) == {
            Objection.IMUS_INCONSISTENT
        }

    def test_push_that_makes_an_inconsistency_smaller_is_welcome(self):
        now = {"offset": (-0.75, 0.15, 0.15)}
        cal = calibration(scale=(1.0,) * 3, offset=(0.15,) * 3)
        assert objections(cal, others=[self.other(1.0)], **now) == set()

    def test_both_pushed_in_one_sitting(self):
        now = {"offset": (1.15, 0.15, 0.15)}
        cal = calibration(scale=(1.0,) * 3, offset=(0.15,) * 3)
        assert objections(cal, others=[self.other(0.0)], **now) == set()


def test_all_objections_are_given_at_once():
    cal = calibration(status=Status.COLLECTING, scale=(1.3, 1.0, 1.0), predictive_gain=-9.0)
    assert objections(cal, condition=FLYING) == {
        Objection.ARMED,
        Objection.NOT_CALIBRATED,
        Objection.OUT_OF_BOUNDS,
        Objection.NO_IMPROVEMENT,
    }


def test_third_accelerometer_has_its_own_names():
    cal = calibration(imu=3)
    plan = propose(cal, current(3), system_id=1)
    assert plan.names == parameter_names(3).six
    assert judge(plan, cal, LANDED, PolicySettings()) == ()


@pytest.mark.parametrize(
    ("armed", "landed", "may_fly"),
    [(False, True, False), (True, False, True), (None, None, True)],
)
def test_what_does_not_say_that_it_stands_may_fly(armed, landed, may_fly):
    assert VehicleCondition(armed=armed, landed=landed).may_fly is may_fly
