"""A flight that does not fit what was written says so, and the next one is asked anew."""

from onboard.daemon.pushing.duties import Duties
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.view.notices import Notices
from onboard.push.entries import Closed, Planned, Result
from onboard.push.journal import Journal
from onboard.push.policy import PolicySettings
from tests.push.test_watch import PUSHED, flown, jumped


def test_the_check_goes_on_until_a_flight_fits_also_over_restarts(tmp_path):
    wanted = PUSHED.plan.wanted
    expected = iter(["doubted", "doubted", "kept"])
    waited = set()
    for flights in ([jumped(0.1)], [jumped(0.1), flown()]):
        with Journal(tmp_path / "journal.jsonl") as journal:
            if not journal.entries:
                journal.append(Planned("t", PUSHED.plan), 1.0)
                journal.append(Closed("t", Result.COMPLETED, "none", "", wanted), 2.0)
            witness, notices = Witness(), Notices(lambda: 3.0)
            ledger = Ledger(journal, lambda: 3.0)
            proposals = Proposals(PolicySettings(), approval=False)
            duties = Duties(ledger, proposals, witness, notices)
            duties.read(busy=False, in_flight_since=None)
            for flight in flights:
                (waiting,) = witness.waiting
                assert waiting not in waited, "what was flown before is not to be judged again"
                verdicts = witness.landed({1: flight})
                assert [v.verdict.value for v in verdicts] == [next(expected)]
                duties.judge(verdicts)
                duties.read(busy=False, in_flight_since=None)
                assert not ledger.condemned
                assert not proposals.standing(1).refused
                waited.add(waiting)
            waited.clear()
            told = [notice.kind for notice in notices.kept]
    assert told == ["push_doubted", "push_kept"]
    assert witness.waiting == frozenset()
