"""What is the same in two answers is not counted, and what is not is measured by its own sigma."""

import json

import pytest

from benchmarks.apart import apart


def answer():
    return json.loads(
        """{
        "imus": [
          {"imu": 1, "status": "calibrated", "scale": [1.01, 0.99], "scale_sigma": [0.001, 0.002],
           "timing": {"gps_delay_s": {"value": 0.12, "sigma": 0.004}}},
          {"imu": 2, "status": "calibrated", "scale": [1.02, 0.98], "scale_sigma": [0.001, 0.001]}
        ],
        "effects": [{"name": "gps_latency", "where": [{"start_s": 1.0}]}, {"name": "wind"}],
        "wind": {"north": 2.0, "sigma_north": 0.5},
        "percent": 80.0, "rejected": {"no_fix": 12}, "unused": ["airspeed"]
        }"""
    )


def test_an_answer_is_not_apart_from_itself():
    assert apart(answer(), answer()).nothing


@pytest.mark.parametrize(
    ("change", "where", "by"),
    [
        (lambda a: a["imus"][0]["scale"].__setitem__(1, 0.995), "imus/1/scale/[1]", 2.5),
        (
            lambda a: a["imus"][0]["timing"]["gps_delay_s"].__setitem__("value", 0.118),
            "imus/1/timing/gps_delay_s/value",
            0.5,
        ),
        (lambda a: a["wind"].__setitem__("north", 2.5), "wind/north", 1.0),
    ],
)
def test_a_number_is_measured_by_the_sigma_that_stands_beside_it(change, where, by):
    now = answer()
    change(now)
    found = apart(answer(), now)
    assert [c.where for c in found.in_sigmas] == [where]
    assert found.in_sigmas[0].by == pytest.approx(by)
    assert not any((found.relative, found.came, found.went, found.said))


def test_the_largest_change_comes_first():
    now = answer()
    now["imus"][0]["scale"] = [1.0101, 0.99]
    now["imus"][1]["scale"] = [1.02, 0.985]
    found = apart(answer(), now)
    assert [c.where for c in found.in_sigmas] == ["imus/2/scale/[1]", "imus/1/scale/[0]"]


def test_members_of_a_list_are_known_by_their_names_and_not_by_their_place():
    now = answer()
    now["imus"].reverse()
    now["effects"].reverse()
    assert apart(answer(), now).nothing


def test_names_that_come_and_go_are_said_once():
    now = answer()
    now["effects"][0] = {"name": "clock_skew", "where": [{"start_s": 1.0}], "share": 0.5}
    now["rejected"]["gps_glitch"] = 3
    now["unused"] = []
    found = apart(answer(), now)
    assert set(found.came) == {"effects/clock_skew", "rejected/gps_glitch"}
    assert set(found.went) == {"effects/gps_latency", "unused"}


def test_two_of_one_name_are_two():
    now = answer()
    now["effects"].append({"name": "wind"})
    assert apart(answer(), now).came == ("effects/wind #2",)


def test_what_has_no_sigma_is_measured_by_itself_and_words_are_quoted():
    now = answer()
    now["percent"], now["imus"][1]["status"] = 60.0, "insufficient"
    found = apart(answer(), now)
    assert (found.relative[0].where, found.relative[0].by) == ("percent", 0.25)
    assert found.said == (("imus/2/status", "calibrated", "insufficient"),)


def test_a_sigma_that_changes_is_a_number_of_its_own():
    now = answer()
    now["wind"]["sigma_north"] = 1.0
    found = apart(answer(), now)
    assert [(c.where, c.by) for c in found.relative] == [("wind/sigma_north", 0.5)]


def test_whoever_had_no_doubt_at_all_is_infinitely_far_off():
    before = {"value": 1.0, "sigma": 0.0}
    assert apart(before, before | {"value": 1.1}).in_sigmas[0].by == float("inf")
