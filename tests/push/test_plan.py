import itertools
import math
from dataclasses import replace

import msgspec
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.errors import PushError
from onboard.push.limits import UNCHANGED
from onboard.push.plan import GRAVITY, Change, PushPlan, Vehicle, offset_is_zero, propose
from tests.autopilot_parameters import float32
from tests.push.calibrations import OFFSET, SCALE, calibration, covariance, current
from tests.push.pushing import make_plan

values = st.floats(-3.5, 3.5).map(float32)
vectors = st.tuples(*[st.one_of(st.just(0.0), values)] * 3)
scales = st.tuples(*[st.floats(0.8, 1.2).map(float32)] * 3)


def test_wanted_is_the_estimate_as_float32():
    plan = propose(calibration(), current(), system_id=1)
    wanted = plan.wanted
    names = parameter_names(1)
    for name, value in zip(names.six, (*SCALE, *OFFSET), strict=True):
        assert wanted[name] == float32(value)
    assert plan.before == {n: float32(v) for n, v in current().items() if n in names.six}
    assert plan.vehicle == Vehicle(1, 3e6)


def test_reversed_twice_is_the_same():
    plan = make_plan()
    back = plan.reversed()
    assert back.wanted == plan.before
    assert back.before == plan.wanted
    assert back.reversed().changes == plan.changes


def test_travels_through_json_unchanged():
    plan = propose(calibration(held_out_before=math.nan), current(), system_id=1)
    assert plan.baseline.held_out_before is None
    assert msgspec.json.decode(msgspec.json.encode(plan), type=PushPlan) == plan


def test_missing_current_value_is_named():
    values = current()
    del values["INS_ACCOFFS_Y"]
    with pytest.raises(PushError, match="INS_ACCOFFS_Y"):
        propose(calibration(), values, system_id=1)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_in_force_makes_no_plan(value):
    with pytest.raises(PushError, match="IMU 1"):
        propose(calibration(), current() | {"INS_ACCOFFS_Y": value}, system_id=1)


@pytest.mark.parametrize(
    "bad",
    [
        {"scale": (math.nan, 1.0, 1.0)},
        {"covariance": covariance(correlations=[(0, 3, 1.1)])},
        {"covariance": covariance(sigmas=(0.0, 1, 1, 1, 1, 1))},
        {"covariance": ((math.nan,) * 6,) * 6},
        {"covariance": ()},
    ],
)
def test_what_is_no_estimate_makes_no_plan(bad):
    with pytest.raises(PushError):
        propose(calibration(**bad), current(), system_id=1)


@pytest.mark.parametrize("imu", [0, 6])
def test_plan_cannot_hold_other_names(imu):
    plan = make_plan()
    with pytest.raises(PushError):
        replace(plan, imu=imu)
    with pytest.raises(PushError):
        replace(plan, imu=2)
    with pytest.raises(PushError):
        replace(plan, changes=plan.changes[::-1])
    alien = Change("INS_ACC_ID", 1.0, 2.0, 0.0, 3.0, 0.1)
    with pytest.raises(PushError):
        replace(plan, changes=(alien, *plan.changes[1:]))


@pytest.mark.parametrize("value", [0.1, math.nan, math.inf])
def test_plan_cannot_hold_what_is_no_float32(value):
    plan = make_plan()
    with pytest.raises(PushError):
        replace(plan, changes=(replace(plan.changes[0], wanted=value), *plan.changes[1:]))


def test_difference_below_the_autopilots_own_epsilon_is_no_change():
    scale = (1.0 + 0.9e-7, *SCALE[1:])
    plan = propose(calibration(scale=scale), current(), system_id=1)
    assert not plan.changes[0].differs
    assert plan.wanted["INS_ACCSCAL_X"] == 1.0


class TestOrder:
    @given(scales, vectors, scales, vectors, st.data())
    def test_offsets_are_never_all_zero_from_any_mixture_in_either_direction(
        self, s0, o0, s1, o1, data
    ):
        assume(not offset_is_zero(o0))
        assume(not offset_is_zero(o1))
        plan = make_plan((s0, o0), (s1, o1))
        undo = data.draw(st.booleans())
        start = {
            n: data.draw(st.sampled_from([plan.before[n], plan.wanted[n]])) for n in plan.names
        }
        target = plan.before if undo else plan.wanted
        assume(not offset_is_zero(tuple(start[n] for n in plan.names[3:])))
        order = plan.write_order(start, undo=undo)
        assert set(order) == {n for n in plan.names if start[n] != target[n]}
        state = dict(start)
        for name in order:
            state[name] = target[name]
            assert not offset_is_zero(tuple(state[n] for n in plan.names[3:]))
        assert state == target

    @given(scales, vectors, scales, vectors, st.booleans())
    def test_of_the_two_mixtures_of_an_axis_the_better_one_is_passed(self, s0, o0, s1, o1, undo):
        plan = make_plan((s0, o0), (s1, o1))
        start = plan.wanted if undo else plan.before
        target = plan.before if undo else plan.wanted
        state = dict(start)
        truth = plan.six_wanted()
        written = set()
        for name in plan.write_order(start, undo=undo):
            state[name] = target[name]
            axis = "XYZ".index(name[-1])
            both = {plan.names[axis], plan.names[3 + axis]}
            if written & both or not all(start[n] != target[n] for n in both):
                written.add(name)
                continue
            written.add(name)
            passed = _error(state, plan, axis, truth)
            other = dict(start)
            (sibling,) = both - {name}
            other[sibling] = target[sibling]
            assert passed <= _error(other, plan, axis, truth) + 1e-6

    def test_a_scale_of_zero_can_be_left_and_gone_back_to(self):
        plan = make_plan(((0.0, 1.0, 1.0), (0.1,) * 3), ((1.01, 1.0, 1.0), (0.2, 0.1, 0.1)))
        assert set(plan.write_order(plan.before)) == {plan.names[0], plan.names[3]}
        back = plan.reversed()
        assert set(back.write_order(back.before)) == {plan.names[0], plan.names[3]}

    def test_one_axis_is_finished_before_the_next_begins(self):
        for scale, offset in itertools.permutations([0.01, 0.1, 0.5], 2):
            plan = make_plan(((1.0,) * 3, (0.1,) * 3), ((1.0 + scale,) * 3, (offset + 1.0,) * 3))
            axes = [n[-1] for n in plan.write_order(plan.before)]
            assert axes[0::2] == axes[1::2]


def _error(state, plan, axis, truth):
    """How wrong this axis reads at the worse of the two specific forces that count.

    What each mixture gets wrong by itself: at rest on that axis for a wrong scale (the right
    offset reads zero right), at zero for a wrong offset.
    """
    s, o = state[plan.names[axis]], state[plan.names[3 + axis]]
    if o == truth.offset[axis]:
        return abs(s / truth.scale[axis] - 1.0) * GRAVITY
    return abs(s * (truth.offset[axis] - o))


def test_zero_vector_is_what_arming_takes_for_one():
    assert offset_is_zero((0.0, -0.0, UNCHANGED / 2))
    assert not offset_is_zero((0.0, 0.0, 0.001))


def test_same_airframe():
    vehicle = Vehicle(1, 5.0, "cafe")
    assert vehicle.same_airframe(1)
    assert vehicle.same_airframe(1, "cafe")
    assert not vehicle.same_airframe(1, "beef")
    assert vehicle.same_airframe(2, "cafe"), "it says which board it is, whatever its system id"
    assert not vehicle.same_airframe(2)
    silent = Vehicle(1, 3e6)
    assert silent.same_airframe(1, "cafe")
    assert not silent.same_airframe(2, "cafe")


def test_six_parameters_of_a_plan():
    plan = make_plan()
    assert isinstance(plan.six_wanted(), SixParameters)
    assert plan.six_before().offset == tuple(plan.before[n] for n in plan.names[3:])
