"""Recordings of which nothing can be learned: what is missing is said, and what to do about it."""

from __future__ import annotations

import copy
import json
import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.cli.main import run
from sitl import recording
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec
from tests.report.html_page import Page

FLOWN_S = 60.0
INERTIAL = ("RAW_IMU", "SCALED_IMU2")
GPS = ("GPS_RAW_INT", "GLOBAL_POSITION_INT")
Stamped = tuple[int, mavlink.MAVLink_message]


@pytest.fixture(scope="module")
def flight() -> list[Stamped]:
    """What a copter with two accelerometers says while it flies."""
    return recording.run(FlightSpec(duration=FLOWN_S, imus=(ImuTruth(), ImuTruth()))).messages


def without(*names: str) -> Callable[[list[Stamped]], Iterable[Stamped]]:
    """The flight without messages of some kinds."""
    return lambda flight: [(t, m) for t, m in flight if m.get_type() not in names]


def changed(name: str, **fields: object) -> Callable[[list[Stamped]], Iterable[Stamped]]:
    """The flight with other numbers in all messages of one kind."""

    def another(message: mavlink.MAVLink_message) -> mavlink.MAVLink_message:
        if message.get_type() != name:
            return message
        made = copy.copy(message)
        for field, value in fields.items():
            setattr(made, field, value)
        return made

    return lambda flight: [(t, another(m)) for t, m in flight]


def begun(seconds: float) -> Callable[[list[Stamped]], Iterable[Stamped]]:
    """The beginning of the flight."""
    return lambda flight: [(t, m) for t, m in flight if t < flight[0][0] + seconds * 1e6]


CUT = {
    "no attitude": (without("ATTITUDE"), "no attitude", "record the attitude as well"),
    "no GPS": (without(*GPS), "no GPS", "record GPS as well"),
    "no fix": (changed("GPS_RAW_INT", fix_type=1), "no fix of the GPS receiver", "a 3D fix"),
    "three satellites": (
        changed("GPS_RAW_INT", satellites_visible=3),
        "no fix that can be trusted (too few satellites, ",
        "see to the GPS receiver",
    ),
    "no heading": (
        changed("EKF_STATUS_REPORT", flags=mavlink.EKF_UNINITIALIZED),
        "no fix that can be trusted (the autopilot's state estimate is not ready, ",
        "see to what the autopilot's EKF complains of",
    ),
    "5 s": (begun(5.0), "none of them in the air", "fly fast"),
    "one after the other": (
        lambda flight: [
            (t, m)
            for t, m in flight
            if not (
                m.get_type() in (*INERTIAL, "ATTITUDE", *GPS)
                and (m.get_type() in INERTIAL) == (t > flight[0][0] + 0.5e6 * FLOWN_S)
            )
        ],
        "never together with attitude and trusted GPS",
        "record the whole flight",
    ),
}


@pytest.fixture(params=CUT, scope="module")
def cut(request, flight, tmp_path_factory) -> tuple[Path, str, str]:
    """A recording, what it lacks, and what to do."""
    spoil, lacks, to_do = CUT[request.param]
    path = tmp_path_factory.mktemp("cut") / "flight.tlog"
    write(path, spoil(flight))
    return path, lacks, to_do


def write(path: Path, messages: Iterable[Stamped]) -> None:
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:
        for unix_us, message in messages:
            file.write(struct.pack(">Q", unix_us) + message.pack(packer))


def said(capsys: pytest.CaptureFixture[str]) -> str:
    """Everything that a person reads, on one line."""
    out, err = capsys.readouterr()
    return " ".join((out + err).split())


@pytest.mark.parametrize("verb", ["replay", "explain"])
def test_it_is_said_what_is_missing_and_what_to_do(cut, tmp_path, capsys, verb):
    path, lacks, to_do = cut
    page, file = tmp_path / "p.html", tmp_path / "d.json"
    assert run([verb, str(path), "--report", str(page), "--json", str(file)]) == 0
    told = said(capsys)
    assert lacks in told
    assert to_do.lower() in told.lower()
    assert "insufficient" in file.read_text()
    shown = Page.of(page.read_text()).words
    assert lacks in shown
    assert to_do.lower() in shown.lower()
    assert f"Fly again: {to_do}" not in shown


def test_match_ends_with_one_line_that_says_it(cut, capsys):
    path, lacks, to_do = cut
    assert run(["match", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    if lacks.startswith("no "):  # what is flight, and what ground, is match's own finding
        assert lacks in err
        assert to_do in err


def test_one_trusted_fix_is_enough_not_to_blame_the_receiver(flight, tmp_path, capsys):
    """Without attitude, or on the ground, the refusals of a receiver are not the reason."""
    path = tmp_path / "flight.tlog"
    write(path, without("ATTITUDE", "EKF_STATUS_REPORT")(flight))
    assert run(["replay", str(path)]) == 0
    assert "can be trusted" not in said(capsys)


def test_several_recordings_that_show_nothing_are_one_answer(flight, tmp_path, capsys):
    paths = [tmp_path / "one.tlog", tmp_path / "two.tlog"]
    for path, spoil in zip(paths, (without(*GPS), without("ATTITUDE", *GPS)), strict=True):
        write(path, spoil(flight[path.name == "two.tlog" :]))
    assert run(["replay", *map(str, paths)]) == 0
    assert "no GPS" in said(capsys)


def test_what_lacks_the_first_accelerometer_is_matched_by_the_second(flight, tmp_path, capsys):
    path, file = tmp_path / "flight.tlog", tmp_path / "d.json"
    write(path, without("RAW_IMU")(flight))
    assert run(["match", str(path), "--json", str(file)]) == 0
    assert said(capsys)
    assert json.loads(file.read_text())["vehicle"] == "copter"


@pytest.mark.parametrize("verb", ["replay", "explain", "match"])
@pytest.mark.parametrize(
    ("spoil", "to_do"),
    [
        (without(*INERTIAL), "SRn_RAW_SENS"),
        (lambda flight: [x for x in flight if x[1].get_type() == "HEARTBEAT"], "SRn_RAW_SENS"),
        (lambda _: [], "copy it again"),
    ],
    ids=["no accelerometer", "one kind of message", "empty"],
)
def test_what_is_no_recording_of_a_flight_is_one_line(flight, tmp_path, capsys, verb, spoil, to_do):
    path = tmp_path / "flight.tlog"
    write(path, spoil(flight))
    assert run([verb, str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert to_do in err


@pytest.mark.parametrize("verb", ["replay", "explain", "match"])
def test_a_directory_is_for_fleet(tmp_path, capsys, verb):
    assert run([verb, str(tmp_path)]) == 2
    assert "onboard fleet" in said(capsys)


@pytest.mark.parametrize("verb", ["replay", "explain", "match"])
def test_numbers_that_no_model_fits_end_in_a_sentence(flight, tmp_path, capsys, monkeypatch, verb):
    """What spoils the diagnosis spoils what is known without it, too: it was a traceback."""

    def spoilt(*_args, **_options):
        raise ValueError("math domain error")

    monkeypatch.setattr("onboard.answers.recorded.examine", spoilt)
    monkeypatch.setattr("onboard.core.estimate.calibrator.Calibrator.calibration", spoilt)
    path = tmp_path / "flight.tlog"
    write(path, flight)
    assert run([verb, str(path)]) == 0
    if verb != "match":  # its vehicle is told all the same
        told = said(capsys)
        assert "could not be diagnosed (math domain error)" in told
        assert "ee to the recording's numbers" in told


@pytest.mark.parametrize("verb", ["replay", "explain", "match"])
def test_an_antenna_a_million_kilometres_away_is_none(flight, tmp_path, verb):
    path, file = tmp_path / "flight.tlog", tmp_path / "d.json"
    far = [
        (t, moved(m) if m.get_type() == "PARAM_VALUE" and m.param_id.startswith("GPS1_POS") else m)
        for t, m in flight
    ]
    write(path, far)
    assert run([verb, str(path), "--json", str(file)]) == 0
    assert "could not be diagnosed" not in file.read_text()


def moved(parameter: mavlink.MAVLink_message) -> mavlink.MAVLink_message:
    made = copy.copy(parameter)
    made.param_value = 1e9
    return made
