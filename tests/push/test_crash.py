"""The daemon dies at every possible moment, on every kind of link.

Invariant: after recovery the autopilot holds all six old or all six new values, in RAM and in
storage, the journal says which, and nothing but the six was ever written.
"""

import itertools
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.mavlink.parameters import ClientSettings
from onboard.push.course import TransactionSettings
from onboard.push.limits import UNCHANGED
from onboard.push.signals import LinkLost, Rebooted, VehicleReport
from tests.push.pushing import NEW, OLD, CrashError, PushWorld, Weather, make_plan


def assert_invariant(world, *, punctual=True):
    assert world.holds() in {"old", "new"}
    assert world.holds() == world.journal_says()
    assert world.journal.recover() == ()
    assert world.only_allowed_names_were_written()
    # A write that overtakes its own roll-back, or a boot, can pass through anything for a moment.
    for state in world.autopilot.states if punctual else ():
        assert any(abs(state[n]) >= UNCHANGED for n in world.plan.names[3:])


def all_lives(make):
    """One world per step of a whole run, each killed one step later."""
    for life in itertools.count():
        world = make(life)
        alive = world.run_through()
        yield life, world, alive
        world.journal.close()
        if alive:
            return


@pytest.mark.parametrize(
    "torn", [b"", b'{"schema":1,"at":3.0,"check":17,"entry":{"kind', b"\x00\xff"]
)
@pytest.mark.parametrize("denied", [None, "INS_ACCSCAL_Z"])
def test_killed_at_every_step_of_a_push_and_of_a_roll_back(tmp_path, torn, denied):
    def make(life):
        world = PushWorld(tmp_path / f"{life}", life=life)
        if denied:
            world.autopilot.denied.add(denied)
        return world

    steps = 0
    for _, world, alive in all_lives(make):
        steps += 1
        if not alive:
            world.autopilot.denied.clear()
            world.restart(torn)
        assert_invariant(world)
        assert not denied or world.holds() == "old"
    assert steps > 40


@pytest.mark.slow
@pytest.mark.parametrize("earliest", [0, pytest.param(3, marks=pytest.mark.slow)])
def test_killed_again_at_every_step_of_the_recovery(tmp_path, earliest):
    number = itertools.count()
    crashed = 0
    for first in range(earliest, 60, 6):
        for second in itertools.count():
            world = PushWorld(tmp_path / f"{next(number)}", life=first)
            assert not world.run_through()
            recovered = _restart_that_dies(world, second)
            crashed += not recovered
            if not recovered:
                world.restart()
            assert_invariant(world)
            world.journal.close()
            if recovered:
                break
    assert crashed > 50


def _restart_that_dies(world, life):
    original = world.restart.__func__
    world.steps = 0
    restart_life = life

    class Mortal(type(world)):
        def _step(self):
            self.steps += 1
            if self.steps > restart_life:
                raise CrashError

    immortal, world.__class__ = world.__class__, Mortal
    try:
        original(world)
    except CrashError:
        return False
    finally:
        world.__class__ = immortal
    return True


@pytest.mark.slow
@settings(max_examples=500, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    lives=st.lists(st.integers(0, 70), max_size=3),
    loss=st.sampled_from([0.0, 0.1, 0.3]),
    duplication=st.sampled_from([0.0, 0.3]),
    late=st.sampled_from([0.0, 0.2]),
    store_delay=st.sampled_from([0.02, 0.4]),
    trouble=st.sampled_from(["none", "arm", "reboot", "silent_reboot", "cut", "deny", "full"]),
    after=st.floats(0.0, 4.0),
    eager=st.booleans(),
    offsets=st.sampled_from(
        [
            (OLD[1], NEW[1]),
            ((0.1, 0.0, 0.0), (0.0, 0.2, 0.0)),
            ((0.0, 0.0, 0.3), (0.0, 0.1, 0.0)),
            ((0.1, 0.2, 0.0), (0.0, 0.0, -0.5)),
            ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3)),
        ]
    ),
)
def test_whatever_happens_it_is_all_old_or_all_new_in_the_end(
    *, seed, lives, loss, duplication, late, store_delay, trouble, after, eager, offsets
):
    plan = make_plan((OLD[0], offsets[0]), (NEW[0], offsets[1]))
    weather = Weather(loss=loss, duplication=duplication, late=late, latest=1.5)
    with tempfile.TemporaryDirectory() as folder:
        world = PushWorld(
            Path(folder) / "j",
            plan,
            weather,
            seed,
            lives[0] if lives else None,
            store_delay=store_delay,
        )
        world.eager = eager
        _arrange(world, trouble, after)
        world.run_through(
            settings=TransactionSettings(client=ClientSettings(attempts=6), settle_s=4.0)
        )
        for life in lives[1:]:
            _restart_that_dies(world, life)
        world.link.cut = False
        world.link.weather.loss = 0.0
        world.autopilot.denied.clear()
        world.autopilot.full = False
        for _ in range(6):
            world.agenda.clear()
            if world.restart(wait=10.0) == 0:
                break
        # What is still under way anywhere must not change it any more.
        world.run()
        if trouble == "full":  # "stored" may have been a duplicate's word: the next boot tells
            world.autopilot.reboot(world.now, silence=1.0)
            world.audit()
        assert_invariant(world, punctual=late == 0.0 and trouble in {"none", "arm", "cut", "deny"})
        world.journal.close()


def _arrange(world, trouble, after):
    autopilot = world.autopilot

    def reboot(*, noticed):
        autopilot.reboot(world.now, silence=2.0)
        if noticed:
            world.feed(Rebooted())

    def cut():
        world.link.cut = True
        world.feed(LinkLost())

    match trouble:
        case "arm":
            world.at(after, lambda: world.feed(VehicleReport(armed=True)))
        case "reboot":
            world.at(after, lambda: reboot(noticed=True))
        case "silent_reboot":
            world.at(after, lambda: reboot(noticed=False))
        case "cut":
            world.at(after, cut)
        case "deny":
            world.at(after, lambda: autopilot.denied.update(world.plan.names[:2]))
        case "full":
            world.at(after, lambda: setattr(autopilot, "full", True))
