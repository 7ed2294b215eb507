"""The sealed challenge: complete, repeatable, and of sizes that were said beforehand."""

from collections import Counter

from benchmarks.concealing import UNITS, Challenge
from sitl.recording import truth_record


def test_the_whole_challenge_has_what_it_promises():
    secrets = Challenge(first=1).secrets()
    kinds = Counter(s.kind for s in secrets)
    assert len(secrets) >= 200
    assert kinds["control"] >= 40
    assert kinds["pair"] >= 40
    assert {s.names[0] for s in secrets if s.kind == "single"} == set(UNITS)
    assert len({s.seed for s in secrets}) == len(secrets)


def test_a_seed_is_always_the_same_secret_and_another_seed_another():
    here, again, other = (Challenge(first=f).secrets() for f in (5, 5, 900))
    records = [[truth_record(s.spec()) for s in some[:12]] for some in (here, again, other)]
    assert records[0] == records[1]
    assert records[0] != records[2]
