"""The challenge at vehicle level: complete, repeatable, sealed before it asks, fairly scored."""

import json
import math
from collections import Counter
from dataclasses import replace

import pytest

from benchmarks.challenge import Measured
from benchmarks.matching.adapter import MatchError, Said, said
from benchmarks.matching.concealing import NAMES, UNSHOWN, Challenge, Secret
from benchmarks.matching.runner import made, one, saturated
from benchmarks.matching.scoring import Outcome, measured, table
from sitl.builtin.airframe.differences import differences
from sitl.recording import truth_record


def answer_of(spec):
    return differences(spec.aircraft)


def test_the_whole_challenge_has_what_it_promises():
    secrets = Challenge(first=1).secrets()
    kinds = Counter(s.kind for s in secrets)
    assert len(secrets) >= 150
    assert kinds["control"] >= 50
    assert {(s.vehicle, s.names[0]) for s in secrets if s.kind == "single"} == {
        (vehicle, name) for vehicle, names in NAMES.items() for name in names
    }
    assert len({s.seed for s in secrets}) == len(secrets)


def test_a_seed_is_always_the_same_secret_and_another_seed_another():
    here, again, other = (
        [truth_record(s.spec()) for s in Challenge(first=f).secrets()[:12]] for f in (5, 5, 900)
    )
    assert here == again
    assert here != other


def test_what_is_concealed_is_what_the_answer_names():
    for secret in Challenge(first=3).secrets():
        spec = secret.spec()
        names = set(answer_of(spec)) | {e.name for e in spec.effects}
        assert names == secret.wanted, secret


def test_small_ones_are_smaller_and_need_not_be_found():
    for vehicle, names in NAMES.items():
        small, large = (Secret(7, vehicle, "single", (names[0],), v) for v in ("small", "large"))
        assert large.testable
        assert not small.testable
        a, b = (answer_of(s.spec())["wind"] for s in (small, large))
        assert math.hypot(*a.values()) < 0.5 * math.hypot(*b.values())
    assert not any(Secret(7, "copter", "single", (name,)).testable for name in UNSHOWN)


def test_a_thing_outside_the_catalogue_has_no_name_but_near_ones():
    secret = Secret(9, "copter", "outside", ("gust",))
    assert secret.wanted == set()
    assert not secret.testable
    assert "turbulence" in secret.allowed
    assert "rotor_drag" not in secret.allowed


def test_a_payload_has_a_name_that_must_be_said():
    secret = Secret(9, "copter", "outside", ("payload",))
    assert secret.wanted == {"mass_change"}
    assert secret.testable
    assert "thrust_scale" in secret.allowed
    assert "rotor_drag" not in secret.allowed
    spec = secret.spec()
    craft = spec.aircraft.craft
    assert answer_of(spec)["mass_change"]["ratio"] == craft.mass / (craft.mass + craft.payload)


def test_what_has_no_name_must_not_be_called_clean():
    secret = Secret(9, "copter", "outside", ("gust",))
    clean, wind = (Outcome(secret, "", {}, Said(v, {})) for v in ("clean", "not_explained"))
    assert clean.overlooked
    assert not wind.overlooked
    assert "1 of those outside the catalogue were called clean" in table([clean, wind])


SHORT_S = (55.0, 60.0)


def perfect(answer):
    return Said(
        "explained",
        {n: {k: (v, 0.01 * abs(v)) for k, v in u.items()} for n, u in answer.items()},
        held_out=(1.0, 0.1),
    )


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["copter", "plane"])
def test_the_answer_is_sealed_before_it_is_asked(vehicle, capsys):
    secret = Secret(11, vehicle, "mixed", ("wind", "gps_latency"), lasting_s=SHORT_S)
    flight, answer = made(secret)
    assert saturated(flight) < 5e-3
    order = []

    def asked(path):
        assert path.stat().st_size > 100_000
        order.append(capsys.readouterr().err)
        return perfect(answer["vehicle"])

    outcome = one(secret, asked)
    assert outcome.seal[:16] in order[0]
    assert outcome.identified
    assert not outcome.false
    assert {m.name for m in outcome.measured} == {"wind.north", "wind.east", "gps_latency.delay"}
    assert all(m.right and m.covered for m in outcome.measured)


@pytest.mark.slow
def test_a_command_that_fails_is_no_answer():
    def asked(path):
        raise MatchError("no such command")

    outcome = one(Secret(12, "copter", "single", ("motor_lag",), lasting_s=SHORT_S), asked)
    assert outcome.said is None
    assert not outcome.identified
    assert "no such command" in outcome.failure
    assert "the command failed" in table([outcome])


DOCUMENT = {
    "schema": "onboard.match/1",
    "verdict": "explained",
    "effects": [
        {"name": "wind", "values": {"north": {"real": 1.0, "sigma": 0.1, "unit": "m/s"}}},
        {"name": "body_drag", "values": {"bcoef_x": {"real": 20.0, "sigma": 1.0}}},
        {"name": "thrust_scale", "values": {"log_ratio": {"real": 0.1, "sigma": 0.01}}},
    ],
    "wind": {"north": 1.2, "east": -0.5, "sigma_north": 0.05, "sigma_east": 0.06},
    "mismatch": {"x": {"before": 3.0, "after": 0.3}, "y": {"before": 4.0, "after": 0.4}},
    "not_testable": [{"name": "ground_effect", "reason": "never near the ground"}],
}


def test_a_document_is_read_whatever_its_keys_convert_to():
    heard = said(json.loads(json.dumps(DOCUMENT)))
    assert heard.values["wind"]["north"] == (1.2, 0.05)
    assert heard.values["body_drag"]["x"] == (pytest.approx(0.05), pytest.approx(0.0025))
    assert heard.values["thrust_scale"]["ratio"][0] == pytest.approx(math.exp(0.1))
    assert heard.held_out == (pytest.approx(math.sqrt(12.5)), pytest.approx(math.sqrt(0.125)))
    assert heard.not_testable == ("ground_effect",)
    with pytest.raises(MatchError, match="something/2"):
        said({"schema": "something/2"})


def test_scores_count_what_is_right_covered_false_and_missed():
    truth = {"wind": {"north": 3.0, "east": 0.05}, "motor_lag": {"time_constant": 0.05}}
    heard = Said("", {"wind": {"north": (3.2, 0.05), "east": (0.3, 0.05)}, "lift": {}})
    values = {m.name: m for m in measured(truth, heard)}
    assert set(values) == {"wind.north", "wind.east"}
    assert values["wind.north"].right  # within ten per cent
    assert values["wind.east"].right  # of the vector's length
    assert not values["wind.north"].covered
    assert not Measured("x", 1.0, 1.5, math.nan, 1.0).right
    secret = Secret(1, "copter", "pair", ("wind", "motor_lag"))
    outcome = Outcome(secret, "", truth, heard, tuple(values.values()))
    assert not outcome.identified
    assert outcome.false == {"lift"}
    named = replace(outcome, said=Said("", {"wind": {}, "motor_lag": {}, "empirical": {}}))
    assert named.identified
    assert not named.false
    assert "1 of 1" in table([named])
