"""Pushes under faults: links, autopilots, disks and clocks that fail, from one seed each."""

import pytest

from benchmarks.pushes.faults import KINDS, draw
from benchmarks.pushes.play import History
from benchmarks.pushes.story import BrokenRuleError

BATCH = 200


@pytest.mark.parametrize("first", range(0, 2000, BATCH))
def test_the_rules_hold_whatever_happens(first, tmp_path):
    for seed in range(first, first + BATCH):
        History(draw(seed), tmp_path).play()


def test_a_history_is_the_same_each_time_it_is_played(tmp_path):
    for seed in (6, 26, 240):
        once, again = draw(seed), draw(seed)
        History(once, tmp_path).play()
        History(again, tmp_path).play()
        assert once.lines == again.lines
        assert len(once.lines) > 3


def test_every_kind_of_fault_is_drawn_and_every_end_is_met(tmp_path):
    scripts = [draw(seed) for seed in range(120)]
    assert {fault.kind for script in scripts for fault in script.faults} == set(KINDS)
    for script in scripts:
        History(script, tmp_path).play()
    told = "\n".join(line for script in scripts for line in script.lines)
    for end in ("completed", "rolled_back", "aborted", "interrupted", "is killed", "takes up"):
        assert end in told


def test_a_broken_rule_is_told_with_its_history(tmp_path, monkeypatch):
    """A transaction that forgets to go back: the rules have teeth."""
    monkeypatch.setattr("onboard.push.course.Course.armed", lambda self, said: None)
    monkeypatch.setattr(
        "onboard.push.transaction.PushTransaction._heartbeat",
        lambda self, said, now, armed: self._course.disarmed(said, now) or (),
    )

    def play_many():
        for seed in range(400):
            History(draw(seed), tmp_path).play()

    with pytest.raises(BrokenRuleError, match=r"seed \d+(.|\n)*RULE: a new value"):
        play_many()
