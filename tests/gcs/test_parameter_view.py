"""OBC_* parameters: names and numbers that stations can show, for any state of the service."""

import re
from pathlib import Path

import msgspec
import pytest

from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import Status
from onboard.core.gps.distrust import Distrust
from onboard.core.physics.catalogue import kinds
from onboard.daemon.outlets import parameter_view
from onboard.daemon.outlets.parameter_view import (
    FINDINGS,
    POLICIES,
    REASONS,
    STATES,
    STATUSES,
    finding_number,
    parameter_values,
)
from onboard.daemon.view.state import NAMES
from onboard.daemon.view.trust import FILTER_UNKNOWN
from onboard.mavlink.parameter_messages import to_float32
from onboard.push.policy import Mode
from tests.gcs.vehicles_state import accelerometer, seen


def values(snapshot, **options):
    return parameter_values(snapshot, **({"imus": 3} | options))


@pytest.mark.parametrize("imus", [1, 3, 5])
def test_names_are_always_the_same_and_fit(imus):
    nothing = parameter_values(seen(), imus=imus)
    everything = parameter_values(
        seen(imus=[accelerometer(n) for n in range(1, 6)]), imus=imus, approving=True
    )
    assert list(nothing) == list(everything)
    assert all(re.fullmatch(r"OBC_[A-Z0-9_]{1,12}", name) for name in nothing)
    assert all(to_float32(value) is not None for value in everything.values())


def test_every_name_is_documented():
    text = parameter_view.__doc__
    for name in values(seen()):
        general = re.sub(r"_\d_", "_n_", name)
        general = re.sub(r"_[YZ]$", "_X", general)
        assert f"``{general}``" in text, name


def test_an_accelerometer_shows_its_six_numbers_with_their_sigmas():
    shown = values(seen(imus=[accelerometer(2)]))
    assert shown["OBC_2_STAT"] == STATUSES["calibrated"]
    assert shown["OBC_2_COV"] == 83.0
    assert [shown[f"OBC_2_SCAL_{a}"] for a in "XYZ"] == [1.02123, 0.98, 1.01]
    assert [shown[f"OBC_2_OFFS_{a}"] for a in "XYZ"] == [0.2123, -0.1, 0.15]
    assert [shown[f"OBC_2_SS_{a}"] for a in "XYZ"] == [0.001, 0.002, 0.003]
    assert [shown[f"OBC_2_SO_{a}"] for a in "XYZ"] == [0.01, 0.02, 0.03]
    assert all(value == 0.0 for name, value in shown.items() if name.startswith("OBC_1_"))
    assert shown["OBC_LATENCY"] == 0.121
    assert shown["OBC_WINDOW"] == 0.2
    assert shown["OBC_COVERAGE"] == 83.0


def test_a_number_that_is_not_there_is_zero_and_a_sigma_that_is_there_is_not():
    nothing = msgspec.structs.replace(
        accelerometer(1).calibration,
        scale=(None, 1.0, 1.0),
        scale_sigma=(None, 1e-9, 1.0),
        offset_sigma=(1e-9, None, 1.0),
    )
    shown = values(seen(imus=[msgspec.structs.replace(accelerometer(1), calibration=nothing)]))
    assert shown["OBC_1_SCAL_X"] == shown["OBC_1_SS_X"] == shown["OBC_1_SO_Y"] == 0.0
    assert 0.0 < shown["OBC_1_SS_Y"] <= 1e-4
    assert 0.0 < shown["OBC_1_SO_X"] <= 1e-3


@pytest.mark.parametrize(
    ("changes", "state"),
    [
        ({"system_id": None}, "no_autopilot"),
        ({"link_state": "silent"}, "no_autopilot"),
        ({}, "waiting"),
        ({"trusted": True}, "learning"),
        ({"trusted": True, "imus": [accelerometer(1)]}, "calibrated"),
        ({"imus": [accelerometer(1), accelerometer(2, status="collecting")]}, "waiting"),
        ({"imus": [accelerometer(1, stands="approval")]}, "approval"),
        ({"imus": [accelerometer(1, stands="up_to_date")]}, "calibrated"),
        ({"imus": [accelerometer(1, stands="held_back")]}, "calibrated"),
        ({"push_state": "writing", "imus": [accelerometer(1)]}, "writing"),
        ({"phase": "stopping"}, "stopping"),
    ],
)
def test_state_in_one_number(changes, state):
    assert values(seen(**changes))["OBC_STATE"] == STATES[state]


def test_what_waits_for_a_person_is_counted():
    states = ("approval", "approval", "calibrated")
    waiting = seen(imus=[accelerometer(n, stands=s) for n, s in enumerate(states, start=1)])
    assert values(waiting)["OBC_WAITING"] == 2.0


def test_trust_and_why_not():
    assert values(seen(trusted=True))["OBC_TRUST"] == 1.0
    shown = values(seen(reason="hdop"))
    assert shown["OBC_TRUST"] == 0.0
    assert shown["OBC_DISTRUST"] == REASONS["hdop"]
    assert values(seen())["OBC_DISTRUST"] == 0.0


def test_tables_know_every_word_of_the_service():
    assert set(POLICIES) == {mode.value for mode in Mode}
    assert {status.value for status in Status} < set(STATUSES) == set(NAMES)
    assert set(REASONS) == {reason.value for reason in Distrust} | {FILTER_UNKNOWN}
    for table in (STATES, STATUSES, REASONS, FINDINGS):
        assert len(set(table.values())) == len(table)


def test_the_manual_has_every_name_and_number():
    manual = (Path(__file__).parents[2] / "docs" / "ground-station.md").read_text(encoding="utf-8")
    for name in values(seen()):
        general = re.sub(r"[YZ]$", "X", re.sub(r"_\d_", "_n_", name))
        assert f"`{general if '_n_' in general else name}`" in manual, name
    sections = re.split(r"^### (\w+)$", manual, flags=re.MULTILINE)
    told = {
        name: {word: int(n) for n, word in re.findall(r"\n\| (-?\d+) \| `(\w+)` \|", text)}
        for name, text in zip(sections[1::2], sections[2::2], strict=True)
    }
    assert told == {
        "OBC_STATE": dict(STATES),
        "OBC_n_STAT": dict(STATUSES),
        "OBC_DISTRUST": dict(REASONS),
        "OBC_FINDING": dict(FINDINGS),
    }
    for kind in kinds():
        assert f"| {kind.code} | `{kind.effect}` | {kind.title} |" in manual


def effect(name, share):
    return {"name": name, "share_of_mismatch": share}


def test_the_top_finding_is_the_one_with_the_largest_share():
    effects = [effect("cross_axis", 0.2), effect("mount_tilt", 0.7), effect("gravity", None)]
    diagnosis = {"verdict": "explained", "effects": effects}
    assert finding_number(diagnosis) == FINDINGS["mount_tilt"]
    assert values(seen(diagnosis=diagnosis))["OBC_FINDING"] == FINDINGS["mount_tilt"]


def test_a_finding_that_falsifies_the_numbers_comes_before_one_that_is_in_every_model():
    effects = [effect("gps_latency", 0.9), effect("gps_lever_arm", 0.05)]
    diagnosis = {"verdict": "explained", "effects": effects}
    assert finding_number(diagnosis) == FINDINGS["gps_lever_arm"]
    assert finding_number(diagnosis | {"effects": effects[:1]}) == FINDINGS["gps_latency"]


@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_verdict_without_effects_has_a_number_of_its_own(verdict):
    number = finding_number({"verdict": verdict.value, "effects": []})
    assert number not in FINDINGS.values()
    expected = {"clean": 0, "insufficient": 90}.get(verdict.value, 99)
    assert number == expected


def test_no_diagnosis_and_an_effect_of_a_newer_version():
    assert finding_number(None) == -1
    assert finding_number({"verdict": "explained", "effects": [effect("gremlins", 1.0)]}) == 98
