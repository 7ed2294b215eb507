"""What was written, and is not there any more: whose doing it is taken for, and what follows."""

import pytest

from onboard.daemon.pushing.aftercare import Aftercare
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.view.notices import Notices
from onboard.push.entries import Closed, Planned, Purpose, Replaced, Result, Verdict, Watched
from onboard.push.journal import Journal
from tests.push.pushing import make_plan

PLAN = make_plan()
WANTED, BEFORE = dict(PLAN.wanted), dict(PLAN.before)
SCALE_X = PLAN.names[0]
MIXED = WANTED | {SCALE_X: BEFORE[SCALE_X]}
OTHERS = MIXED | {PLAN.names[1]: 0.9}


class Bench:
    """Aftercare of one journal on disk; ``lives`` of the service follow each other."""

    def __init__(self, path):
        self.path, self.journal = path, None
        self.begin()
        self.journal.append(Planned("a", PLAN), 1.0)
        self.journal.append(Closed("a", Result.COMPLETED, "none", "", WANTED), 2.0)
        self.care.wrote(1, "a")

    def begin(self):
        """The service starts, for the first time or again."""
        if self.journal is not None:
            self.journal.close()
        self.journal = Journal(self.path)
        self.ledger = Ledger(self.journal, lambda: 3.0)
        self.ledger.system_id = PLAN.vehicle.system_id
        self.notices = Notices(lambda: 3.0)
        self.care = Aftercare(self.ledger, self.notices)

    def look(self, values, *, unasked=True):
        self.care.look(values, values.keys(), unasked=unasked)

    def silence(self):
        self.care.silent()
        self.care.begin()

    def reboot(self, values=WANTED):
        self.care.rebooted(values, busy=False)
        self.care.begin()

    @property
    def told(self):
        return {notice.kind for notice in self.notices.kept}

    @property
    def ours(self):
        """Whether what was written is still looked after."""
        return 1 in self.ledger.left()


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path / "journal.jsonl")
    bench.look(WANTED)
    yield bench
    bench.journal.close()


def test_what_is_there_is_nothing_to_be_told_of_again_and_again(bench):
    for _ in range(5):
        bench.look(WANTED)
    assert (bench.told, bench.care.lost, bench.care.mixed) == (set(), {}, {})
    bench.silence()
    bench.look(WANTED)
    assert bench.told == {"push_stored"}


@pytest.mark.parametrize("values", [MIXED, OTHERS, BEFORE])
@pytest.mark.parametrize("then", [Bench.silence, Bench.reboot, Bench.begin])
def test_a_change_that_was_seen_is_somebodys_for_good(bench, values, then):
    bench.look(values)
    assert bench.told == {"push_replaced"}
    for after in (values, MIXED, BEFORE):
        then(bench)
        bench.look(after)
        assert not bench.ours
        assert (bench.care.lost, bench.care.mixed) == ({}, {})
        assert bench.told <= {"push_replaced"}


def test_a_change_told_just_before_a_reboot_was_seen_too(bench):
    bench.reboot(MIXED)
    bench.look(MIXED)
    assert not bench.ours
    assert not bench.care.lost


def test_without_a_reboot_nothing_is_lost_so_somebody_has_set_it(bench):
    bench.silence()
    bench.look(MIXED)
    assert bench.told == {"push_replaced"}
    assert not bench.care.lost


def test_what_a_reboot_before_our_eyes_has_lost_is_undone(bench):
    bench.reboot()
    bench.look(MIXED)
    recovery = bench.care.lost[1]
    assert (recovery.transaction, recovery.undo) == ("a", True)
    assert "interrupted" not in recovery.sentence
    bench.look(OTHERS)  # somebody came first
    assert bench.care.lost == {}
    assert not bench.ours


@pytest.mark.parametrize("how", ["approval", "silent", "restarted"])
def test_what_cannot_be_told_apart_is_asked(bench, how):
    if how == "silent":
        bench.care.silent()
    bench.reboot()
    if how == "restarted":
        bench.begin()
    bench.look(MIXED, unasked=how != "approval")
    assert bench.told == {"push_mixed"}
    assert bench.care.lost == {}
    assert bench.care.mixed[1].transaction == "a"
    bench.look(MIXED)
    bench.silence()
    bench.reboot()
    bench.look(MIXED)
    assert len(bench.notices.kept) == 1, "it is told once"
    assert 1 in bench.care.mixed
    bench.look(WANTED)
    assert bench.care.mixed == {}
    assert bench.ours


def test_of_what_is_asked_somebodys_answer_by_hand_is_the_end(bench):
    bench.begin()
    bench.look(MIXED)
    bench.look(BEFORE)
    assert bench.care.mixed == {}
    assert not bench.ours


@pytest.mark.parametrize("then", [Bench.reboot, Bench.begin])
def test_where_nothing_is_left_nothing_is_to_be_written(bench, then):
    then(bench)
    bench.look(BEFORE)
    assert bench.told == {"push_gone"}
    assert (bench.care.lost, bench.care.mixed) == ({}, {})
    assert not bench.ours


def test_a_flight_with_other_values_has_ended_it(bench):
    bench.journal.append(Watched("a", Verdict.SUPERSEDED, "somebody"), 3.0)
    bench.reboot()
    bench.look(MIXED)
    assert (bench.told, bench.care.lost, bench.care.mixed) == (set(), {}, {})


@pytest.mark.parametrize("values", [MIXED, WANTED])
def test_a_way_back_that_a_backup_has_undone_is_left_to_people(bench, values):
    bench.journal.append(Watched("a", Verdict.WORSE, "it flew worse"), 3.0)
    bench.journal.append(Planned("back", PLAN.reversed(), Purpose.ROLL_BACK), 3.0)
    bench.journal.append(Closed("back", Result.COMPLETED, "none", "", BEFORE), 3.0)
    bench.begin()
    bench.look(values)
    list(bench.ledger.judged())
    assert (bench.care.lost, bench.ledger.condemned) == ({}, {})
    assert bool(bench.care.mixed) == (values is MIXED)


def test_a_mark_outlives_the_journals_cleaning(tmp_path):
    with Journal(tmp_path / "journal.jsonl", limit_bytes=20_000, keep=3) as journal:
        journal.append(Planned("a", PLAN), 1.0)
        journal.append(Closed("a", Result.COMPLETED, "none", "", WANTED), 2.0)
        journal.append(Replaced("a", "somebody"), 3.0)
        for i in range(40):
            other = make_plan(imu=2)
            journal.append(Planned(f"b{i}", other), 4.0)
            journal.append(Closed(f"b{i}", Result.COMPLETED, "none", "", other.wanted), 4.0)
        assert len({e.transaction for _, e in journal.entries}) < 30
        assert journal.replaced() == {"a"}
        assert journal.recover() == ()


@pytest.mark.parametrize(("values", "half"), [(MIXED, True), (OTHERS, False), (BEFORE, False)])
def test_who_sets_some_of_the_old_values_is_told_that_the_others_are_new(bench, values, half):
    bench.look(values)
    (notice,) = [n for n in bench.notices.kept if n.kind == "push_replaced"]
    assert notice.warning is half
    assert ("the others are as they were written" in notice.text) is half
