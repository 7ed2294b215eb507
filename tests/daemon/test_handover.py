"""Whose what was learned is: of the board that is there, or of the one before."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from onboard.daemon.learning.handover import Handover
from onboard.daemon.learning.identity import Identity
from onboard.daemon.view.notices import Notices


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
