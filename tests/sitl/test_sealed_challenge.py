"""The sealed challenge: complete, repeatable, and of sizes that were said beforehand."""

from collections import Counter

import numpy as np

from benchmarks.concealing import UNITS, Challenge, Harder
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


def test_a_harder_one_has_curves_and_clipping_beside_other_effects():
    secrets = Harder(first=7).secrets()
    assert len({s.seed for s in secrets}) == len(secrets)
    curves = [s for s in secrets if s.curved]
    assert {len(s.names) for s in curves} == {1, 2}
    assert {s.vehicle for s in curves} == {"copter", "plane"}
    for secret in curves:
        spec = secret.spec()
        (drift,) = [e for e in spec.effects if e.name == "temperature_drift"]
        assert any(drift.square)
        assert any(drift.cube)
        warm = np.array((spec.imus[0].temperature_start, spec.imus[0].temperature_end)) - 35.0
        law = np.outer(warm, drift.sizes) + np.outer(warm**2, drift.square)
        assert np.all(np.abs(law + np.outer(warm**3, drift.cube)) < 3.0), "no sensor is worse"
    clipped = [s for s in secrets if "saturation" in s.names]
    assert clipped
    assert all(len(s.spec().effects) == 2 for s in clipped)
