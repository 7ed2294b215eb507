"""A vehicle's numbers over time, from simulated records to the words and the document."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from onboard.answers.fleet.document import FleetDocument, fleet_document
from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Asked, Record
from onboard.answers.fleet.severity import Severity, sentences, severity_of, shared_sentence
from onboard.answers.fleet.shared_numbers import common_of
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.core.diagnosis import together
from onboard.core.estimate.joint import FLOOR
from onboard.core.estimate.result import Status
from onboard.core.maths.chi_square import survival
from tests.fleet.records_by_hand import TRUE, flown

STEP = np.array([0.0, 0.0, 0.0, 0.4, 0.0, 0.0])


def history(recordings):
    (vehicle,) = vehicles_of(recordings)
    return history_of(vehicle)


def number(h, name):
    return next(n for n in h.accelerometers[0].numbers if n.name == name)


def season(count, change=lambda k: np.zeros(6), seed=0, **more):
    return [
        flown(f"{k:02}.BIN", TRUE + change(k), day=3.0 * k, seed=100 * seed + k, **more)
        for k in range(count)
    ]


def test_a_vehicle_on_which_nothing_happened_is_well_and_merged():
    h = history(season(10))
    assert severity_of(h) is Severity.WELL
    assert sentences(h) == ()
    merged = h.accelerometers[0].merged
    assert len(merged.counted) == 10
    assert np.all(np.abs(merged.value - TRUE) < 4.0 * merged.sigma)


def test_a_vehicle_that_flies_with_other_parameters_than_a_flight_asks_for_is_not_well():
    old, new = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), tuple(TRUE)
    asking = flown("a.BIN", TRUE, day=0.0, asks=True, in_force=old)
    h = history([asking])
    assert severity_of(h) is Severity.TO_SET
    (said,) = sentences(h)
    assert "accelerometer 1: a.BIN" in said
    # A later flight that shows too little does not answer the question.
    short = flown("b.BIN", TRUE, day=1.0, status=Status.INSUFFICIENT, in_force=old)
    assert severity_of(history([asking, short])) is Severity.TO_SET
    # Once they are in force, nothing is asked for.
    set_since = flown("b.BIN", TRUE, day=1.0, status=Status.INSUFFICIENT, in_force=new)
    assert severity_of(history([asking, set_since])) is Severity.WELL
    agreed = flown("b.BIN", TRUE, day=1.0, in_force=new)
    assert severity_of(history([asking, agreed])) is Severity.WELL


def test_why_no_flight_has_calibrated_a_vehicle_is_said():
    drifting = "the offset follows the temperature"
    h = history([flown("a.BIN", TRUE, status=Status.INSUFFICIENT, missing=drifting)])
    assert severity_of(h) is Severity.UNKNOWN
    (said,) = sentences(h)
    assert "missing from the model" in said
    assert drifting in said


def test_a_vehicle_of_which_nobody_knows_what_is_in_force_is_not_well():
    """It was told that there is nothing to do, whatever the flight had found."""
    untold = flown("a.BIN", TRUE, known=False)
    h = history([untold])
    assert severity_of(h) is Severity.UNKNOWN
    (said,) = sentences(h)
    assert "does not say which parameters were in force" in said
    told = flown("b.BIN", TRUE, day=1.0)
    assert severity_of(history([untold, told])) is Severity.WELL


def test_nothing_is_said_of_vehicles_on_which_nothing_happened():
    """All numbers of a vehicle together have one false alarm in a hundred."""
    said = sum(bool(sentences(history(season(8, seed=s)))) for s in range(60))
    assert said <= 3


def test_maintenance_is_named_with_the_flights_about_it_and_ends_what_is_merged():
    h = history(season(12, lambda k: STEP * (k >= 7)))
    course = number(h, "x offset").course
    assert [s.after for s in course.steps] == [6]
    merged = h.accelerometers[0].merged
    assert set(merged.counted) == {7, 8, 9, 10, 11}
    assert merged.value[3] == pytest.approx(TRUE[3] + 0.4, abs=4.0 * merged.sigma[3])
    assert severity_of(h) is Severity.CHANGED
    (said,) = sentences(h)
    assert "x offset stepped by +0.4" in said
    assert "between 06.BIN" in said
    assert "and 07.BIN" in said


def test_no_number_of_flights_makes_the_floors_less():
    """What no model knows is the same in all flights: averaging them does not help against it."""
    h = history(season(60))
    for n in (*h.accelerometers[0].numbers, *h.numbers):
        assert n.latest[1] >= n.common
    assert number(h, "x scale").common == FLOOR[0]
    assert number(h, "x scale").latest[1] > 0.9 * FLOOR[0]


def test_a_flight_that_contradicts_the_others_is_named_and_not_averaged():
    h = history(season(9, lambda k: 2.0 * STEP * (k == 4)))
    assert [o.flight for o in number(h, "x offset").course.odd] == [4]
    merged = h.accelerometers[0].merged
    assert 4 not in merged.counted
    assert merged.value[3] == pytest.approx(TRUE[3], abs=4.0 * merged.sigma[3])
    assert severity_of(h) is Severity.CONTRADICTED
    assert any("04.BIN" in s for s in sentences(h))


def test_what_drifts_has_no_mean_but_a_value_now():
    h = history(season(14, lambda k: STEP * k / 6.0))
    course = number(h, "x offset").course
    assert course.drifts
    assert course.trend.size == pytest.approx(0.4 / 18.0, abs=4.0 * course.trend.sigma)
    assert course.latest[0] == pytest.approx(TRUE[3] + 0.4 * 13 / 6.0, abs=5.0 * course.latest[1])
    assert h.accelerometers[0].merged is None
    assert "x offset drifts" in h.accelerometers[0].why


def test_another_sensor_in_its_place_is_another_sensor():
    logs = season(5) + [flown(f"n{k}", TRUE + STEP, day=40.0 + k, device=9) for k in range(4)]
    h = history(logs)
    assert [(a.device, len(a.flights)) for a in h.accelerometers] == [(7, 5), (9, 4)]


def test_a_flight_that_says_nothing_is_listed_with_its_reason():
    h = history([*season(4), flown("hover.BIN", day=50.0, why="it hovered")])
    left_out = h.accelerometers[0].left_out
    assert [(f.flown.name, why) for f, why in left_out] == [("hover.BIN", "it hovered")]


def test_what_a_type_shares_is_said_with_its_scatter_and_else_not():
    rng = np.random.default_rng(3)
    logs = [
        flown(
            f"{v}-{k}", day=v + 10.0 * k, board=f"{v:024x}", seed=10 * v + k,
            antenna=(0.3 + place, 0.0, 0.0), delay=0.12 + late,
        )
        for v, (place, late) in enumerate(rng.normal(0.0, [0.02, 0.01], (8, 2)), start=1)
        for k in range(3)
    ]  # fmt: skip
    found = common_of(vehicles_of(logs))
    assert {(c.name, c.of) for c in found.common} == {
        ("antenna_x_m", "copter Pixhawk6X frame class 1"),
        ("gps_delay_s", "u-blox 000A0000"),
    }
    place = next(c for c in found.common if c.name == "antenna_x_m")
    assert place.shared.mean == pytest.approx(0.3, abs=4.0 * place.shared.sigma)
    assert "antenna forward beside what is told +0.29" in shared_sentence(place)
    assert common_of(vehicles_of([o for o in logs if o.name[0] in "12"])).common == ()


def test_recordings_that_may_be_one_vehicle_are_no_type():
    logs = [flown(f"{k}", day=k, board="", seed=k, antenna=(0.5, 0, 0)) for k in range(9)]
    found = common_of(vehicles_of(logs))
    assert (found.common, found.looked_at) == ((), 0)


def test_the_document_is_compatible_and_says_everything_in_finite_numbers():
    logs = season(8, lambda k: STEP * (k >= 5))
    histories = [history_of(v) for v in vehicles_of(logs)]
    document = fleet_document(logs, histories, common_of([h.vehicle for h in histories]))
    text = document.to_json()
    assert b"NaN" not in text
    assert b"Infinity" not in text
    again = msgspec.json.decode(text, type=FleetDocument)
    assert again.schema == "onboard.fleet/1"
    assert (again.read, again.failed) == (8, 0)
    (vehicle,) = again.vehicles
    assert vehicle.identified_by == "board"
    numbers = {n.name: n for n in vehicle.accelerometers[0].numbers}
    step = numbers["x offset"].steps[0]
    assert (step.after, step.before) == ("/logs/04.BIN", "/logs/05.BIN")
    assert step.step.p_value <= vehicle.false_alarm / vehicle.looked_at
    assert numbers["x offset"].chi_square < 40.0
    assert survival(numbers["x offset"].chi_square, numbers["x offset"].dof) > 1e-4


def test_a_record_goes_through_the_store_unchanged_to_the_last_digit():
    record = flown("a", TRUE * (1.0 + 1e-15), seed=1).record
    data = msgspec.msgpack.encode(record)
    again = msgspec.msgpack.decode(data, type=Record)
    assert msgspec.msgpack.encode(again) == data
    one, other = again.imus[0].calibration, record.imus[0].calibration
    assert one.scale + one.offset == other.scale + other.offset
    assert one.covariance == other.covariance
    assert one.status is other.status
    assert again.imus[0].said == record.imus[0].said


def leaks(size):
    """What a flight says of axes that are not square: 0.1 sigma of it, which moves the x offset."""
    information, moves = np.eye(6) / 0.1**2, np.zeros((6, 6))
    moves[3, 0] = -0.5
    value = np.array([size, 0.0, 0.0, 0.0, 0.0, 0.0])
    said = together.Asked("cross_axis", "", information, information @ value, np.ones(6), moves)
    return Asked.of(said)


def test_an_effect_that_all_flights_ask_for_is_in_the_sigmas_and_said():
    h = history(season(12, asked=[leaks(0.3)]))
    plain = history(season(12))
    merged, without = h.accelerometers[0].merged, plain.accelerometers[0].merged
    assert merged.value == pytest.approx(without.value)
    assert merged.sigma[3] > 3.0 * without.sigma[3]
    assert number(h, "x offset").latest[1] > number(plain, "x offset").latest[1]
    assert number(h, "y offset").latest == pytest.approx(number(plain, "y offset").latest)
    (said,) = sentences(h)
    assert said.startswith("accelerometer 1: the flights together leave open whether")
    assert severity_of(h) is Severity.WELL
    document = fleet_document(
        [f.flown for f in h.vehicle.flights], [h], common_of([h.vehicle])
    ).vehicles[0]
    assert "cross_axis" in document.accelerometers[0].merged.note


def test_what_flights_before_a_step_ask_for_is_asked_of_them_alone():
    """The sensor that is there now is another one."""
    old = season(8, lambda k: STEP, asked=[leaks(0.6)])
    new = [flown(f"new{k}.BIN", TRUE, day=30.0 + k, seed=50 + k) for k in range(8)]
    merged = history([*old, *new]).accelerometers[0].merged
    assert len(merged.counted) == 8
    assert merged.open == ""
    assert np.all(merged.open_sigma == 0.0)


def test_what_a_flight_says_of_effects_is_kept_to_the_last_digit():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3))
    said = together.Asked(
        "temperature_drift",
        "",
        root @ root.T,
        rng.normal(size=3),
        rng.normal(size=3) ** 2,
        rng.normal(size=(6, 3)),
    )
    kept = msgspec.msgpack.decode(msgspec.msgpack.encode(Asked.of(said)), type=Asked).asked
    for name in ("information", "vector", "prior", "moves"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(said, name))
    assert "temperature" in kept.title


def test_of_a_recording_that_shows_nothing_it_is_said_what_to_do():
    blind = flown("a.BIN", TRUE, status=Status.INSUFFICIENT, trusted=0.0)
    (imu,) = blind.record.imus
    note, to_do = "accelerometer 1: 900 samples, and no attitude", "record it with attitude"
    seen = replace(imu.calibration.coverage, advice=to_do)
    c = replace(imu.calibration, note=note, coverage=seen)
    of_struct = msgspec.structs.replace
    record = of_struct(blind.record, imus=[of_struct(imu, calibration=c)])
    h = history([replace(blind, record=record)])
    assert sentences(h) == (f"accelerometer 1: 900 samples, and no attitude; {to_do}",)
