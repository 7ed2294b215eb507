"""Three offsets of zero mean "never calibrated" to ArduPilot: they are never all zero."""

import pytest

from onboard.push.entries import Result
from tests.push.pushing import NEW, OLD, PushWorld, finish, make_plan, when_written


class TestOffsetsNeverAllZero:
    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ((0.1, 0.0, 0.0), (0.0, 0.2, 0.0)),
            ((0.0, 0.0, 0.3), (0.0, 0.1, 0.0)),
            ((0.1, 0.2, 0.0), (0.0, 0.0, -0.5)),
            ((0.0, 0.0, 0.0), (0.0, 0.0, -0.5)),
        ],
    )
    @pytest.mark.parametrize("deny", [None, "INS_ACCSCAL_X"])
    def test_on_the_way_there_and_back(self, tmp_path, old, new, deny):
        world = PushWorld(tmp_path / "j", make_plan((OLD[0], old), (NEW[0], new)))
        if deny:
            world.autopilot.denied.add(deny)
        assert world.run_through()
        zero = [not any(s[n] for n in world.plan.names[3:]) for s in world.autopilot.states]
        # Only the old values themselves may be zero: at the beginning, and after a roll-back.
        if any(old):
            assert not any(zero)
        else:
            inner = zero[zero.index(False) :] if False in zero else []
            assert inner.count(True) == (1 if deny else 0) or not any(inner)
        assert world.holds() == ("old" if deny else "new")


def test_roll_back_beside_somebody_elses_zero_leaves_an_offset(tmp_path):
    """Old (0.1, 0, 0); another station zeroes x meanwhile: undoing y would leave three zeros."""
    world = PushWorld(
        tmp_path / "j", make_plan((OLD[0], (0.1, 0.0, 0.0)), (NEW[0], (0.2, 0.3, 0.0)))
    )
    when_written(world, 4, lambda: world.autopilot.set_by_other("INS_ACCOFFS_X", 0.0, world.now))
    outcome = finish(world)
    assert outcome.result is Result.ROLLED_BACK
    assert outcome.left == ("INS_ACCOFFS_X", "INS_ACCOFFS_Y")
    scales = world.plan.names[:3]
    assert all(world.autopilot.ram[n] == world.plan.before[n] for n in scales)
