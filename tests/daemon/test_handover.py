"""Whose what was learned is: of the board that is there, or of the one before."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from onboard.daemon.learning.handover import Handover
from onboard.daemon.learning.identity import Identity
from onboard.daemon.view.notices import Notices
from onboard.mavlink.bootclock import BootClock
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import mavlink


class Pupil:
    """Learns nothing, and is looked at while it does."""

    def __init__(self) -> None:
        self.meanwhile = lambda: None
        self.who = None

    def identify(self, identity, _told):
        self.who = identity

    def gap(self, *, rebooted=False):
        pass

    def learn(self, _samples, **_):
        self.meanwhile()
        return SimpleNamespace(news=(), diagnosing=(), flight=None, of=self.who)

    def save(self, _saved_at):
        pass


@pytest.fixture
def pupil():
    return Pupil()


@pytest.fixture
def handover(pupil):
    there = SimpleNamespace(identity=Identity(1), introduced=True, judging=(), in_flight=False)
    return Handover(
        pupil,
        Notices(lambda: 0.0),
        there=there,
        clock=lambda: 0.0,
        wall_clock=lambda: 0.0,
        save_every_s=1e9,
    )


async def test_what_another_board_has_taught_is_not_of_the_one_that_is_there(handover, pupil):
    await handover.step()
    assert handover.identified
    first, second = pupil.who, Identity(1, board="0b")
    handover.gap()
    assert not handover.identified
    handover._there.identity = second
    seen = []
    pupil.meanwhile = lambda: seen.append((handover.identified, handover.learned.of))
    await handover.step()
    assert seen == [(False, first)], "the batch of the new one is not learned yet"
    assert handover.identified
    assert handover.learned.of == second


async def test_a_gap_while_a_batch_is_learned_leaves_nobody_identified(handover, pupil):
    await handover.step()
    pupil.meanwhile = handover.gap
    await handover.step()
    assert not handover.identified
    pupil.meanwhile = lambda: None
    await handover.step()
    assert handover.identified


@pytest.mark.parametrize("count", [1, 2, 40])
@pytest.mark.parametrize("off", [-20.0, -600.0, 3600.0])
def test_the_estimator_hears_of_no_boot_that_the_link_has_not_told(handover, off, count):
    """Packets that a line has held back, or damaged; and then a reboot."""
    clock = BootClock()
    handover.decoder = Decoder(1, 1, clock=clock)

    def say(t, now):
        message = mavlink.MAVLink_raw_imu_message(round(1e6 * t), 0, 0, -1000, 1, 2, 3, 0, 0, 0)
        message.get_srcSystem = message.get_srcComponent = lambda: 1
        clock.observe(message, now)
        return [round(sample.t, 6) for sample in handover.take(message)]

    for k in range(100):
        assert say(1000.0 + 0.02 * k, 0.02 * k) == [round(1000.0 + 0.02 * k, 6)]
    for k in range(count):
        # What comes ahead at once is no more than one stamp, as often as it comes.
        assert say(1002.0 + off + (0.02 * k if off < 0 else 0.0), 2.0) == []
    assert say(1002.02, 2.02) == [1002.02]
    assert clock.reboots == 0
    after = [t for k in range(10) for t in say(0.4 + 0.02 * k, 3.0 + 0.02 * k)]
    assert clock.reboots == 1
    assert after == pytest.approx([0.42 + 0.02 * k for k in range(9)])
    assert handover.counters["samples_of_no_boot"] == count + 1
