"""A flight that the simulator flies again with what was found: it flies like the recording."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from onboard.answers.flown_again import Courses, beside, flown_again, numbers_twice
from onboard.answers.match import Setting
from onboard.answers.match_document import match_document
from onboard.cli import match_verify
from onboard.cli.main import run
from onboard.cli.match import flown_again_table
from onboard.cli.match_verify import air_of, altitude_of, as_sitl, craft_of, turning_rudder
from onboard.cli.terminal import Terminal
from onboard.core.vehicle.atmosphere import density
from onboard.core.vehicle.plane_airframe import MASS_KG, PlaneAirframe
from onboard.core.vehicle.records import Compared, Difference
from onboard.core.vehicle.signals import Signals, Stream
from onboard.errors import UsageError
from onboard.report.match import match_html
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.wing import Wing
from sitl.recording import FlightSpec, write_tlog
from tests.report.html_page import Page
from tests.report.matches_by_hand import by_hand

NO_SIGNALS = Signals(kind="plane")


def course(seconds=60.0, ahead=0, force=(0.0, 0.0, -9.8)):
    t = 0.2 * (np.arange(round(seconds / 0.2)) + ahead)
    v = np.column_stack([5.0 * np.sin(0.3 * t), 4.0 * np.cos(0.17 * t), 0.0 * t])
    return Courses(v, np.tile(force, (len(t), 1)), np.zeros((len(t), 2)))


def test_flights_that_begin_at_other_times_are_laid_side_by_side():
    found = beside(course(), course(ahead=37))
    assert all(v == pytest.approx(0.0, abs=1e-9) for v in found.values())


def test_what_differs_is_measured_where_it_moves():
    found = beside(course(force=(0.3, 0.0, -9.8)), course(ahead=-11))
    assert found["x"] == pytest.approx(0.3)
    assert found["y"] == pytest.approx(0.0, abs=1e-12)


def with_numbers(**numbers: Compared) -> Any:
    match = by_hand()
    names = {k.replace("__", "."): v for k, v in numbers.items()}
    return replace(match, vehicle=replace(match.vehicle, numbers=names))


def test_numbers_agree_within_5_per_cent_or_3_sigma():
    first = with_numbers(rotor_drag__mcoef=Compared(0.25, 0.5, 0.001, "1/s"))
    for again, agrees in ((0.52, True), (0.56, False)):
        second = with_numbers(rotor_drag__mcoef=Compared(0.5, again, 0.001, "1/s"))
        (twice,) = numbers_twice(first, second).values()
        assert twice.agrees is agrees


def test_a_flight_that_tells_nothing_is_not_flown_like_the_recording(monkeypatch, capsys):
    """All of no numbers agree; what was found has to be found again."""
    flights = iter([course(), course(), course(force=(6.0, 0.0, -9.8))])
    monkeypatch.setattr("onboard.answers.flown_again.courses", lambda _: next(flights))
    first = with_numbers(rotor_drag__mcoef=Compared(0.25, 0.5, 0.001, "1/s"))
    why = "force and velocity contradict each other"
    silent = replace(first.vehicle, numbers={}, effects=(), series=None, note=why)
    record = flown_again(first, replace(first, vehicle=silent), "a", "b", "c")
    assert not record.agrees
    Terminal().print(flown_again_table(record))
    said = " ".join(capsys.readouterr().out.split())
    assert f"could not fly it as it was: {why}" in said
    assert "rotor_drag.mcoef: 0.5000 recorded, not told by the simulator's flight" in said
    assert why in Page.of(match_html(first, record)).words
    assert match_document(first, record).verified.untold == why


def test_a_number_that_is_not_told_again_does_not_agree():
    first = with_numbers(rotor_drag__mcoef=Compared(0.25, 0.5, 0.001, "1/s"))
    (twice,) = numbers_twice(first, with_numbers()).values()
    assert not twice.agrees


@pytest.mark.parametrize(("found", "moment"), [(-0.8, 0.4), (-0.2, 0.1), (0.0, 0.1)])
def test_a_rudder_that_pushes_more_turns_more(found, moment):
    """The arm of the tail is the same; one that pushes less has turned the plane all the same."""
    number = Compared(-0.2, found, 0.02, "1")
    effect = Difference("side_force", "vehicle", {"c_y_deltar": number})
    match = by_hand(vehicle="plane", effects=(effect,), numbers={"side_force.c_y_deltar": number})
    assert turning_rudder(match.vehicle) == pytest.approx(moment)
    assert turning_rudder(by_hand(vehicle="plane").vehicle) == Wing().c_n_deltar


def test_thrust_is_compared_with_the_first_flights_and_not_with_the_frame_that_has_it():
    found = Compared(1.0, 0.78, 0.004, "1")
    effect = Difference("thrust_scale", "vehicle", {"ratio": found})
    first = by_hand(effects=(effect,))
    for again, agrees in ((1.002, True), (1.1, False)):
        pair = (
            replace(first, vehicle=replace(first.vehicle, numbers={"thrust_scale.ratio": value}))
            for value in (found, replace(found, real=again))
        )
        (twice,) = numbers_twice(*pair).values()
        assert twice.again == pytest.approx(0.78 * again)
        assert twice.agrees is agrees


def test_the_air_presses_on_the_built_in_plane_as_on_ardupilots():
    """Whose coefficients are meant for the density taken twice; at 2000 m that is a fifth."""
    ours, theirs = as_sitl(Wing(), 2000.0), PlaneAirframe()
    rho, speed = density(2000.0), 22.0
    alpha, still = np.array([0.06]), np.zeros(1)
    pressure = np.array([0.5 * rho * speed**2])
    lift, drag = ours.coefficients(alpha)
    by_mass = theirs.pressure(rho, np.array(speed)) * MASS_KG
    force = ours.force(alpha, still, still, pressure)[0]
    assert np.linalg.norm(force) == pytest.approx(by_mass * np.hypot(lift[0], drag[0]))
    np.testing.assert_allclose(ours.coefficients(alpha), Wing().coefficients(alpha))
    assert as_sitl(Wing(), 0.0).s == pytest.approx(Wing().s)
    match: Any = replace(by_hand(), real=SimpleNamespace(ground=580.0))
    assert altitude_of(match) == pytest.approx(580.0 + match.vehicle.wind.height)


def test_the_air_that_is_flown_is_the_air_that_was_found():
    match = by_hand()
    assert air_of(match) == Air(north=-3.0, east=4.0)
    wind = replace(match.vehicle.wind, height=15.0, profile_exponent=0.5)
    grown = air_of(replace(match, vehicle=replace(match.vehicle, wind=wind)))
    at_15_m = grown.steady(np.array([15.0]), np.array([0.0]))[0]
    assert at_15_m[:2] == pytest.approx([-3.0, 4.0])
    assert air_of(by_hand(effects=())) == Air()


def test_the_airframe_that_is_flown_has_the_keys_of_the_frame_file():
    match = replace(by_hand(), frame={"mdrag_coef": 0.4, "motor1_vector": [0.06, 0.0, -1.0]})
    craft = craft_of(match)
    assert craft.mdrag_coef == 0.4
    assert craft.motor_vector == (0.06, 0.0, -1.0)


@pytest.mark.parametrize(
    ("parameters", "name"),
    [
        ({"ARSPD_RATIO": 1.6}, "SIM_ARSPD_RATIO"),
        ({"ARSPD_RATIO": 3.0, "ARSPD2_RATIO": 1.6, "ARSPD_PRIMARY": 1.0}, "SIM_ARSPD2_RATIO"),
    ],
)
def test_an_airspeed_sensor_errs_by_the_ratio_that_is_set_over_the_right_one(parameters, name):
    """Set to 1.6 where 2.0 is right: the built-in autopilot has 2.0 set."""
    real: Any = SimpleNamespace(ground=0.0, signals=SimpleNamespace(parameters=parameters))
    setting = Setting(name, 2.0, 0.01, "airspeed_scale")
    match = replace(by_hand(vehicle="plane"), real=real, settings=(setting,), frame={})
    craft = craft_of(match)
    assert isinstance(craft, Wing)
    assert Wing().airspeed_ratio / craft.airspeed_ratio == pytest.approx(1.6 / 2.0)


def test_a_recording_that_cannot_be_flown_again_is_named(tmp_path, capsys):
    path = tmp_path / "x.csv"
    path.write_text("a\n1\n")
    columns = tmp_path / "m.toml"
    columns.write_text("")
    assert run(["match", str(path), "--columns", str(columns), "--verify"]) == 2
    assert "[time] is missing" in capsys.readouterr().err


def test_only_the_part_that_follows_the_recording_is_laid_beside_it():
    whole = replace(course(), start=100.0)
    part = whole.between((101.0, 103.0))
    assert part.start == pytest.approx(101.0)
    assert len(part.v_n) == round(2.0 / 0.02)
    assert part.v_n == pytest.approx(whole.v_n[round(1.0 / 0.02) :][: len(part.v_n)])
    assert whole.between(None) is whole


@pytest.fixture
def no_ardupilot(tmp_path, monkeypatch):
    """A machine without ArduPilot's simulator, whatever this one has."""
    monkeypatch.delenv("ARDUPILOT_SITL_DIR", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "none"))


@pytest.fixture
def flight(tmp_path, monkeypatch, no_ardupilot):
    """Asks ``verify`` of a copter that has been matched; returns what was flown, by whom."""
    flown = []

    def by(simulator):
        def fly(result, recording, folder, binary):
            flown.append((simulator, binary))
            nominal, found = folder / "nominal", folder / "found"
            return match_verify.Flights(nominal, found, simulator)

        return fly

    monkeypatch.setattr(match_verify, "_by_ardupilot", by("ArduPilot"))
    monkeypatch.setattr(match_verify, "_by_built_in", by("built-in"))
    monkeypatch.setattr(match_verify, "match_recordings", lambda *_, **__: None)
    told = {}
    monkeypatch.setattr(match_verify, "flown_again", lambda *_, **more: told.update(more) or told)

    def ask(vehicle="copter", ardupilot=None, signals=NO_SIGNALS):
        kind = SimpleNamespace(recordings=[SimpleNamespace(kind="dataflash")])
        result = SimpleNamespace(
            real=SimpleNamespace(source=kind, signals=signals),
            vehicle=SimpleNamespace(vehicle=vehicle, series=object()),
            frame={},
        )
        return match_verify.verify(result, tmp_path / "x.BIN", ardupilot)["simulator"]

    ask.flown = flown
    return ask


def test_the_hover_of_a_quadplane_is_not_flown_by_a_plane(flight):
    t = np.arange(0.0, 20.0, 0.1)
    functions = {f"SERVO{k}_FUNCTION": 28.0 + k for k in range(5, 9)}
    for us, refused in ((1450.0, True), (1000.0, False)):
        outputs = np.column_stack([np.full((len(t), 4), 1500.0), np.full((len(t), 4), us)])
        signals = Signals(outputs=Stream(t, outputs), parameters=functions, kind="plane")
        if refused:
            with pytest.raises(UsageError, match="no simulator's plane has upright rotors"):
                flight("plane", signals=signals)
        else:
            assert flight("plane", signals=signals) == "built-in"


def binary(folder, vehicle="copter"):
    folder.mkdir(exist_ok=True)
    made = folder / f"ardu{vehicle}"
    made.write_text("#!/bin/sh\n")
    made.chmod(0o755)
    return folder


def test_without_ardupilots_simulator_the_built_in_one_flies(flight):
    assert flight() == "built-in"


def test_ardupilots_simulator_flies_where_it_is(flight, tmp_path, monkeypatch):
    folder = binary(tmp_path / "bin")
    assert flight(ardupilot=folder) == "ArduPilot"
    assert flight.flown == [("ArduPilot", folder)]
    monkeypatch.setenv("ARDUPILOT_SITL_DIR", str(folder))
    assert flight() == "ArduPilot"
    assert flight("plane") == "built-in"


def test_what_was_asked_for_and_is_not_there_is_no_other_simulators_flight(flight, tmp_path):
    with pytest.raises(UsageError, match="no arducopter binary"):
        flight(ardupilot=tmp_path)
    with pytest.raises(UsageError, match="planes"):
        flight("plane", ardupilot=binary(tmp_path / "bin", "plane"))
    assert flight.flown == []


def test_ardupilots_simulator_is_for_verify(capsys):
    assert run(["match", __file__, "--ardupilot", "x"]) == 2
    assert "--ardupilot is for --verify" in capsys.readouterr().err


@pytest.mark.slow
def test_a_flight_is_flown_again_as_it_was(tmp_path, no_ardupilot):
    log, answer, page = (tmp_path / n for n in ("flight.tlog", "a.json", "a.html"))
    craft = Airframe().with_drag(mcoef=0.45)
    aircraft = Aircraft(craft=craft, air=Air(north=3.0, east=-2.0))
    write_tlog(FlightSpec(seed=4, duration=130.0, aircraft=aircraft), log)
    arguments = ["--verify", "--json", str(answer), "--report", str(page)]
    assert run(["match", str(log), *arguments]) == 0
    v = json.loads(answer.read_text())["verified"]
    assert v["agrees"], v
    assert v["effects_left"] == []
    assert v["numbers"]["rotor_drag.mcoef"]["again"] == pytest.approx(0.45, rel=0.05)
    for key in ("x", "y", "tilt"):
        assert v["mismatch"][key]["after"] < 0.2 * v["mismatch"][key]["before"], v["mismatch"]
    said = Page.of(page.read_text()).words
    assert "The built-in simulator flies like the recording" in said


def test_the_page_shows_what_was_flown_again(monkeypatch):
    match = with_numbers(rotor_drag__mcoef=Compared(0.25, 0.5, 0.001, "1/s"))
    flights = iter([course(), course(force=(0.4, 0.0, -9.8)), course(force=(0.01, 0.0, -9.8))])
    monkeypatch.setattr("onboard.answers.flown_again.courses", lambda _: next(flights))
    other = with_numbers(rotor_drag__mcoef=Compared(0.5, 0.9, 0.001, "1/s"))
    second = replace(other, real=SimpleNamespace(name="again"))
    record = flown_again(match, second, "a", "b", "c")
    said = Page.of(match_html(match, record)).words
    assert "Flown again with what was found" in said
    assert "0.40 → 0.010 m/s²" in said
    assert "still shows: drag of the rotors" in said
