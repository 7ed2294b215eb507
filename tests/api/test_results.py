"""Results say what the commands say, in arrays, records, files and a notebook's cell."""

from __future__ import annotations

import json
import random
import re
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest

import onboard
from onboard import api
from onboard.cli.main import run
from onboard.errors import OnboardError, RecordingError, UsageError
from tests.api.conftest import TRUTH
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.telemetry_writer import px4_log
from tests.report.html_page import Page

pytestmark = pytest.mark.slow


def settings(text: str) -> dict[str, float]:
    """What a parameter file sets."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {name: float(value) for name, value in (line.split(",") for line in lines)}


@pytest.mark.parametrize(
    ("verb", "name"), [("replay", "calibration"), ("explain", "explanation"), ("match", "match")]
)
def test_document_report_and_parameters_are_those_of_the_command(asked, tmp_path, verb, name):
    files = [str(tmp_path / f"{verb}.{kind}") for kind in ("json", "html", "param")]
    options = zip(("--json", "--report", "--param"), files, strict=True)
    assert run([verb, str(asked.path), *(x for pair in options for x in pair)]) == 0
    document, page, param = [Path(file).read_text(encoding="utf-8") for file in files]
    result = getattr(asked, name)
    assert result.to_json() == document
    assert result.to_dict() == json.loads(document)
    assert result.report(tmp_path / "a.html").read_text(encoding="utf-8") == page
    assert result.param(tmp_path / "a.param").read_text(encoding="utf-8") == param
    if verb != "match":
        entry = asked.calibration.imu(1) if verb == "replay" else result.accelerometer
        assert settings(param) == pytest.approx(dict(entry.parameters), rel=1e-6)
        assert entry.parameters


def test_the_numbers_are_those_of_the_flight(asked):
    imu = asked.calibration.imu(1)
    assert imu.status == "calibrated"
    assert np.all(np.abs(imu.scale - TRUTH.scale) < 4.0 * imu.scale_sigma)
    assert np.all(np.abs(imu.offset - TRUTH.offset) < 4.0 * imu.offset_sigma)
    delay = imu.timing["gps_delay_s"]
    assert abs(delay.value - 0.12) < 4.0 * delay.sigma
    assert "rotor_drag" in asked.match.effects
    assert [e.name for e in asked.explanation.effects] == [e.name for e in imu.effects]


def test_sigmas_are_those_of_the_covariance_which_is_one(asked):
    imu = asked.calibration.imu(1)
    sigma = np.concatenate([imu.scale_sigma, imu.offset_sigma])
    assert np.sqrt(np.diag(imu.covariance)) == pytest.approx(sigma)
    assert imu.covariance == pytest.approx(imu.covariance.T)
    assert np.linalg.eigvalsh(imu.covariance / np.outer(sigma, sigma)).min() > 0.0


def test_the_residual_is_smaller_with_what_was_found(asked):
    found = asked.explanation
    assert found.before.shape == found.after.shape == (len(found.t), 3)
    assert np.all(np.diff(found.t) >= 0.0)
    assert np.nanstd(found.after) < np.nanstd(found.before)


@pytest.mark.parametrize("name", ["calibration", "explanation", "match"])
def test_records_are_plain_and_all_alike(asked, name):
    rows = getattr(asked, name).rows()
    assert rows
    for row in rows:
        assert row.keys() == rows[0].keys()
        assert {type(value) for value in row.values()} <= {str, float, int, bool}
    json.dumps(rows)


def test_records_say_what_is_set(asked):
    rows = asked.calibration.rows()
    assert len(rows) == 6
    to_set = {r["parameter"]: r["to_set"] for r in rows if np.isfinite(r["to_set"])}
    assert to_set == asked.calibration.imu(1).parameters


@pytest.mark.parametrize("name", ["calibration", "explanation", "match"])
def test_results_cannot_be_changed(asked, name):
    result = getattr(asked, name)
    with pytest.raises(FrozenInstanceError):
        result.files = ()
    with pytest.raises(AttributeError):
        _ = result.__dict__
    with pytest.raises(ValueError, match="read-only"):
        asked.calibration.imu(1).scale[0] = 1.0


@pytest.mark.parametrize("name", ["calibration", "explanation", "match"])
def test_the_head_in_a_notebook_is_well_formed_and_alone(asked, name):
    html = getattr(asked, name)._repr_html_()
    page = Page.of(html)
    tags = {tag for tag, _ in page.tags}
    assert not tags & {"script", "iframe", "link", "html", "body", "h1", "h2", "img", "object"}
    assert not re.search(r"https?:|//[a-z]|@import|url\(|javascript:", html)
    assert not any("id" in attributes or "href" in attributes for _, attributes in page.tags)
    assert len(html) < 20_000
    # Nothing of its style reaches what else is on the page.
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL)[1]
    bare = re.sub(r"/\*.*?\*/", "", style, flags=re.DOTALL)
    for selectors in re.findall(r"([^{}]+)\{", bare):
        if not selectors.strip().startswith("@media"):
            assert all(one.strip().startswith("div.onboard-head") for one in selectors.split(","))


def test_the_head_is_the_beginning_of_the_report(asked, tmp_path):
    report = Page.of(asked.calibration.report(tmp_path / "r.html").read_text(encoding="utf-8"))
    head = Page.of(asked.calibration._repr_html_())
    ours = head.words.partition("flight.tlog ·")[2]
    assert ours
    assert ours in report.words


def test_names_are_escaped_in_the_head(tmp_path):
    path = tmp_path / "<script>alert(1)</script>.BIN".replace("/", "_")
    path.write_bytes(bytes(modern_log(6)))
    result = onboard.calibrate(path)
    for html, ours in (
        (result._repr_html_(), 0),
        (result.report(tmp_path / "r.html").read_text(), 1),
    ):
        assert html.count("<script") == ours
        assert "&lt;script" in html


@pytest.mark.parametrize("name", ["calibration", "explanation", "match"])
def test_text_is_short_and_begins_with_the_recording(asked, name):
    result = getattr(asked, name)
    lines = str(result).splitlines()
    assert "flight.tlog" in lines[0]
    assert 3 <= len(lines) <= 20
    assert lines[0] in repr(result)
    assert "\n" not in repr(result)


def test_two_recordings_are_merged_as_the_command_does(tmp_path):
    logs = [tmp_path / "monday.BIN", tmp_path / "tuesday.BIN"]
    for seconds, log in zip((6, 8), logs, strict=True):
        log.write_bytes(bytes(modern_log(seconds)))
    out = tmp_path / "out.json"
    assert run(["replay", *map(str, logs), "--json", str(out)]) == 0
    result = onboard.calibrate(logs)
    assert result.to_json() == out.read_text(encoding="utf-8")
    assert [entry.imu for entry in result] == [1, 2]
    assert len(result) == 2
    assert result.files == tuple(map(str, logs))


def test_another_autopilot_has_no_parameters(tmp_path):
    path = tmp_path / "x.ulg"
    path.write_bytes(px4_log(5))
    result = onboard.calibrate(str(path))
    assert not any(entry.parameters for entry in result)
    assert {row["parameter"] for row in result.rows()} == {""}
    result.param(tmp_path / "x.params")
    assert "INS_" not in (tmp_path / "x.params").read_text()


def test_progress_is_told(tmp_path):
    path = tmp_path / "x.BIN"
    path.write_bytes(bytes(modern_log(6)))
    told = []
    onboard.calibrate(path, imu=2, progress=told.append)
    assert told[-1] == 1.0


@pytest.mark.parametrize(
    ("asking", "error", "said"),
    [
        (lambda: onboard.calibrate("nowhere.BIN"), RecordingError, "nowhere.BIN: no such file"),
        (lambda: onboard.explain([]), UsageError, "no recording given"),
        (lambda: onboard.calibrate(7), UsageError, "a int is no recording"),
        (lambda: onboard.calibrate(["x.BIN", None]), UsageError, "a NoneType is no recording"),
        (onboard.match, UsageError, "match takes one recording"),
        (lambda: onboard.match("nowhere.BIN", frame="no.json"), UsageError, "no.json: cannot be"),
    ],
)
def test_errors_are_of_our_tree_and_name_what_is_wrong(asking, error, said):
    with pytest.raises(error, match=said):
        asking()
    assert issubclass(error, OnboardError)


def test_what_cannot_be_done_with_a_result_is_named(asked, tmp_path):
    with pytest.raises(UsageError, match="no accelerometer 3 in the result"):
        asked.calibration.imu(3)
    with pytest.raises(UsageError, match="cannot be written"):
        asked.calibration.report(tmp_path / "none" / "r.html")


def test_a_frame_and_a_recording_that_cannot_be_used_are_named(tmp_path):
    path = tmp_path / "short.BIN"
    path.write_bytes(bytes(modern_log(6)))
    with pytest.raises(UsageError, match="no frame of a simulator"):
        onboard.match(path, frame={"mass": "x"})
    with pytest.raises(RecordingError, match=r"short\.BIN"):
        onboard.match(path)


def test_numbers_that_no_model_fits_are_an_error_with_a_name(asked, monkeypatch):
    def singular(*_args):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("onboard.answers.match.match_copter", singular)
    with pytest.raises(RecordingError, match=r"flight\.tlog: its numbers fit no model"):
        api.match(asked.path)


def test_every_answer_says_what_was_skipped_of_its_recording(asked, tmp_path):
    data = asked.path.read_bytes()
    path, middle = tmp_path / "hurt.tlog", len(data) // 2
    path.write_bytes(data[:middle] + random.Random(7).randbytes(3000) + data[middle:-7])
    for ask in (api.explain, api.match):
        result = ask(path)
        document = result.to_dict()
        place = "recording" if ask is api.explain else "recordings"
        told, cut = document[place]["damage"]
        assert told.startswith("hurt.tlog: 1 damaged place, 30")
        assert "cut off" in cut
        for sentence in (told, cut):
            assert f"damage: {sentence}" in str(result)
            assert sentence in Page.of(result._repr_html_()).words
