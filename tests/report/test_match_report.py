"""The page of a match: what it says is what the JSON says, and it needs nothing but itself."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import nan

import numpy as np
import pytest

from onboard.answers import match_story as story
from onboard.answers import words
from onboard.answers.match_document import match_document
from onboard.answers.match_words import named
from onboard.core.diagnosis.records import Verdict
from onboard.core.vehicle.records import (
    Compared,
    Difference,
    ForceSeries,
    VehicleMatch,
    WindEstimate,
)
from onboard.report.match import match_html
from onboard.report.match_charts import most_shown
from onboard.report.page import HEAD
from tests.report.html_page import Page
from tests.report.matches_by_hand import ROTORS, WIND, by_hand


def page(**changes: object) -> Page:
    return Page.of(match_html(by_hand(**changes)))


def test_every_part_of_the_story_is_there():
    said = page().words
    for heading in (
        "What differs",
        "Before and after, on flight not used in the fit",
        "Where it differs",
        "By speed over ground",
        "Wind over height",
        "Laws and their data",
        "Settings for the simulator",
        "Could not be told apart",
        "What this flight did not show",
        "Fly this to find out",
    ):
        assert heading in said, heading
    assert "Hover at half a metre." in said
    assert "not flown near the ground" in said
    assert "10 to 22 s: turning at 5 m/s, mostly to the sides" in said


def test_it_asks_for_nothing_outside_itself():
    html = match_html(by_hand())
    tags = Page.of(html).tags
    assert not {"link", "img", "iframe", "object"} & {tag for tag, _ in tags}
    for _, attributes in tags:
        assert not {"src", "href", "onload", "onclick"} & set(attributes)
    assert not re.search(r"https?:|url\(|@import", html)


def test_files_are_written_by_what_the_reader_has_in_hand():
    whole, head = page().words, Page.of(match_html(by_hand(), base=HEAD)).words
    assert "--frame-out" in whole
    assert "--param" in whole
    assert "frame_file()" in head
    assert "param()" in head
    assert "--frame-out" not in head
    assert "--param" not in head


def test_no_frame_file_is_to_be_loaded_where_the_airframe_is_right():
    match = by_hand()
    of_air = tuple(d for d in match.effects if d.name == "wind")
    assert of_air
    told = "load the frame file"
    assert told in page().words.lower()
    assert told not in Page.of(match_html(replace(match, effects=of_air))).words.lower()


def test_names_of_files_and_numbers_of_others_are_escaped():
    html = match_html(by_hand(name="<script>alert(1)</script>.BIN", note="a < b & c"))
    assert html.count("<script") == 1  # ours
    assert "&lt;script&gt;alert" in html
    assert "&lt;script&gt;" in html
    assert "a &lt; b &amp; c" in html


def test_numbers_are_those_of_the_document():
    match = by_hand()
    said = Page.of(match_html(match)).words
    document = json.loads(match_document(match).to_json())
    for axis in ("x", "y"):
        m = document["mismatch"][axis]
        assert f"{words.number(m['before'], 2)} → {words.number(m['after'], 2)} m/s²" in said
    alone = document["mismatch"]["velocity_after_10s"]
    assert f"{words.number(alone['before'], 2)} → {words.number(alone['after'], 2)} m/s" in said
    for effect in document["effects"]:
        assert effect["name"] in said
        for value in effect["values"].values():
            shown = [w.replace("−", "-") for w in re.findall(r"−?\d+\.\d+", said)]
            assert any(abs(float(w) - value["real"]) < value["sigma"] / 2.0 for w in shown)
    for name, value in document["settings"].items():
        assert f"{name} {words.setting(value)}" in said


def test_a_flight_that_agrees_has_no_cards_and_nothing_to_set():
    said = page(effects=(), ambiguous=()).words
    assert "Nothing: the simulation's airframe flies like this recording." in said
    assert "Settings for the simulator" not in said
    assert "Could not be told apart" not in said


def test_a_recording_without_anything_is_still_a_page():
    nothing = by_hand(effects=())
    empty = VehicleMatch("unknown", not_testable=nothing.not_testable, note="no GPS")
    match = replace(nothing, vehicle=empty, verdict=Verdict.INSUFFICIENT)
    said = Page.of(match_html(match)).words
    assert "No GPS" in said
    assert "This recording says too little" in said
    assert "nan" not in said.lower().split()


def test_a_number_that_is_not_known_is_not_drawn():
    bare = WindEstimate(1.0, 2.0, np.nan, np.nan, 10.0)
    odd = replace(WIND, held_out_before=np.nan, share=np.nan)
    html = match_html(by_hand(wind=bare, alone=None, effects=(odd,)))
    assert "NaN" not in html
    assert ">nan" not in html
    Page.of(html)


def test_one_scale_for_all_axes():
    """Where nothing differs, nothing should seem to."""
    charts = [t for t in page().tags if t[0] == "path" and (t[1].get("class") or "") == "grid"]
    assert charts
    html = match_html(by_hand())
    figures = re.findall(r"<figure>.*?</figure>", html, re.DOTALL)
    of_forces = [f for f in figures if "(x)" in f or "(y)" in f]
    marks = [re.findall(r'class="tick y"[^>]*>([^<]+)<', f) for f in of_forces]
    assert len(marks) == 2
    assert marks[0] == marks[1]


@pytest.mark.parametrize("name", [n for n in story.SENTENCES if n != "wind"])
def test_every_effect_has_a_sentence_even_with_numbers_that_nobody_expects(name):
    odd = Difference(name, "vehicle", {"strange": Compared(1.0, 2.0, 0.1, "m")})
    said = story.sentence(odd)
    assert "strange 2.0 ± 0.1 m" in said or said.endswith("differs from the simulation's.")


def test_sentences_say_what_a_pilot_asks():
    assert story.sentence(WIND) == (
        "The wind was 5.00 ± 0.02 m/s from 307°; the simulation's air stands still."
    )
    assert "2.0 times as much as in the simulation: 0.497 ± 0.003" in story.sentence(ROTORS)
    tilt = Difference(
        "thrust_tilt",
        "vehicle",
        {"x": Compared(0.0, 0.0599, 0.001, "rad"), "y": Compared(0.0, 0.0001, 0.001, "rad")},
    )
    assert story.sentence(tilt).endswith("they lean 3.43 ± 0.06° forward.")
    lag = Difference("motor_lag", "vehicle", {"time_constant": Compared(0.0, 0.06, 0.003, "s")})
    assert "60 ± 3 ms late" in story.sentence(lag)
    values = {"ratio": Compared(1.0, 0.877, 0.002, "1"), "moment": Compared(nan, 97.5, 0.14, "s")}
    dropped = Difference("mass_change", "vehicle", values)
    assert "12.3 ± 0.2 % less from 97.5 ± 0.1 s on" in story.sentence(dropped)
    late = Difference("gps_latency", "sensor", {"delay": Compared(0.1, 0.22, 0.004, "s")})
    assert story.sentence(late) == "GPS is 220 ± 4 ms late; the simulation's is 100 ms late."


@pytest.mark.parametrize(
    ("delay", "said"),
    [
        (-0.0176, "GPS is 17.6 ± 0.6 ms ahead of its stamps; the simulation's is 100 ms late."),
        (0.03, "GPS is only 30.0 ± 0.6 ms late; the simulation's is 100 ms late."),
    ],
)
def test_a_receiver_that_is_less_late_than_the_simulations_is_not_said_to_be_late(delay, said):
    value = Compared(0.1, delay, 0.0006, "s")
    assert story.sentence(Difference("gps_latency", "sensor", {"delay": value})) == said


def test_what_the_simulation_has_nothing_of_is_said_once_and_not_by_number():
    values = {"time": Compared(0.0, 213.0, 13.0, "s"), "z": Compared(0.0, 0.071, 0.007, "m/s^2")}
    said = story.sentence(Difference("bias_step", "sensor", values))
    assert said.endswith("z 0.071 ± 0.007 m/s²; nothing of it in the simulation.")
    assert "(simulation" not in said


def test_a_flight_that_nothing_is_told_of_has_no_seconds():
    assert "100 s in the air" in page(seconds=100.0).words
    assert "s in the air" not in page(series=None, seconds=0.0).words


def test_what_a_flight_does_not_tell_apart_is_said_in_headline_and_sentence():
    thrust = Difference(
        "thrust_scale", "vehicle", {"ratio": Compared(1.0, 1.29, 0.08, "1")}, rivals=("drag",)
    )
    assert named(thrust) == "thrust by mass or drag"
    assert story.sentence(thrust).endswith("; or it is drag: this flight does not tell which.")
    assert "or it is" not in story.sentence(replace(thrust, rivals=()))
    assert named(replace(thrust, level="sensor")) == "thrust by mass"


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("axes", [1, 3])
def test_an_axis_that_alone_is_far_off_is_drawn_all_but_its_rarest_moments(axis, axes):
    """Nearly all of *all* errors would cut the peaks of one axis among three, before and after."""
    rng = np.random.default_rng(5)
    before = rng.normal(0.0, 0.01, (1000, axes))
    axis %= axes
    before[:, axis] = rng.normal(0.0, 3.0, 1000)
    still = np.zeros((1000, axes))
    series = ForceSeries(np.arange(1000.0), ("x", "y", "z")[:axes], still, before, still)
    cut = np.abs(before[:, axis]) > most_shown(series)
    assert cut.mean() <= 0.003


def test_nothing_measured_has_a_scale_all_the_same():
    nothing = np.full((4, 3), nan)
    series = ForceSeries(np.arange(4.0), ("x", "y", "z"), nothing, nothing, nothing)
    assert most_shown(series) == 1.0


def test_no_line_ends_between_a_number_and_its_sigma_or_per_cent():
    html = match_html(by_hand())
    text = re.sub(r"<(style|script|svg).*?</\1>", "", html, flags=re.DOTALL)
    assert "\u00a0±\u00a0" in text
    assert "\u00a0%" in text
    assert not re.search(r"\d [±%]|± \d", text)


def test_effects_in_the_note_have_their_names_of_the_cards():
    note = "thrust_scale and lift would explain a part of what is left"
    said = page(note=note).words
    assert "Thrust by mass and lift would explain" in said
    assert "thrust_scale and" not in said
