"""The page: self-contained, well-formed, complete, small, and honest about what is not known."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from onboard.core.diagnosis.records import Diagnosis, Verdict
from onboard.core.physics.finding import Imprint, Quantity, ResponseCurve
from onboard.report.explain import explain_html
from tests.explained import explained
from tests.report.diagnoses_by_hand import advice_on, diagnosis, effect, told_apart_not, unknown
from tests.report.html_page import Page


def page(d: Diagnosis, files=("flight.tlog",), autopilot: str = "ardupilot") -> tuple[str, Page]:
    advice = advice_on(d) if autopilot == "ardupilot" else None
    html = explain_html(d, files=files, autopilot=autopilot, duration_s=300.0, advice=advice)
    return html, Page.of(html)


@pytest.mark.parametrize("make", [diagnosis, unknown, told_apart_not])
def test_is_well_formed_and_refers_to_nothing_outside(make):
    html, parsed = page(make())
    assert not re.search(r"https?:|//[a-z]|@import|url\(", html)
    assert [attributes for tag, attributes in parsed.tags if tag == "script"] == [{}]
    for _, attributes in parsed.tags:
        for name in ("src", "href", "xlink:href", "srcset"):
            assert (attributes.get(name) or "data:").startswith("data:")


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_with_and_without_effects(verdict):
    for effects in ((), (effect(),)):
        _, parsed = page(diagnosis(verdict=verdict, effects=effects))
        assert verdict.value.replace("_", " ") in parsed.words


def test_says_what_how_sure_and_what_to_change():
    _, parsed = page(diagnosis())
    for said in (
        "GPS is late",
        "210.0 ± 4.0 ms",
        "83 % of the mismatch",
        "set GPS1_DELAY_MS",
        "GPS1_DELAY_MS = 210",
        "GPS averages its velocity",
        "no temperature in the recording",
        "+ GPS is late gps_latency",
        "1.0123",
        "turning (60 s)",
    ):
        assert said in parsed.words


def test_the_verdict_names_what_was_found_and_proves_it_in_metres_per_second():
    html, parsed = page(diagnosis())
    assert re.search(r"<h1>GPS is late</h1>", html)
    for said in ("GPS is late by 210 ± 4 ms.", "0.055 m/s", "0.65 m/s", "−92\u00a0%".strip()):
        assert said.replace("\u00a0", " ") in parsed.words
    assert "0.650 m/s" in parsed.words  # the ladder's first step, held out


def test_an_effect_is_drawn_over_the_data_that_it_explains():
    t = np.arange(100) * 0.2
    imprint = Imprint("earth_east", t, np.sin(t), 0.9 * np.sin(t))
    response_curve = ResponseCurve(
        signal="temperature",
        unit="°C",
        quantity="offset error",
        quantity_unit="m/s^2",
        x=np.linspace(20.0, 50.0, 30),
        y={"x": np.linspace(-0.1, 0.2, 30), "y": np.full(30, np.nan)},
        sigma={"x": np.full(30, 0.01), "y": np.full(30, np.nan)},
    )
    html, parsed = page(
        diagnosis(effects=(effect(imprint=imprint, response_curve=response_curve),))
    )
    assert "East velocity: data and effect" in parsed.words
    assert "Offset error over temperature" in parsed.words
    assert len(re.findall('class="line (data|made)"', html)) == 2
    assert len(re.findall('class="ribbon', html)) == 1


@pytest.mark.parametrize("verdict", [Verdict.CLEAN, Verdict.INSUFFICIENT])
def test_where_nothing_was_found_nothing_is_shaded(verdict):
    html, parsed = page(diagnosis(verdict=verdict, effects=()))
    assert "band located" not in html
    assert "Where the mismatch is largest" not in parsed.words


def test_charts_say_in_words_what_they_show():
    _, parsed = page(diagnosis())
    drawn = [a for tag, a in parsed.tags if tag == "svg"]
    assert drawn
    assert all(a.get("role") == "img" and re.search(r"\d", a["aria-label"] or "") for a in drawn)


def test_angles_are_shown_in_degrees():
    tilt = effect("mount_tilt", unknowns={"roll": Quantity(0.0349066, 0.00174533, "rad")})
    assert "2.00 ± 0.10 °" in page(diagnosis(effects=(tilt,)))[1].words


def test_what_is_not_known_is_never_drawn_nor_printed_as_a_number():
    html, parsed = page(unknown())
    assert not re.search(r"\b(nan|inf)\b", html, re.IGNORECASE)
    assert "not known" in parsed.words
    assert "no data to draw" in parsed.words


def test_long_recordings_stay_small_and_keep_their_peak():
    d = diagnosis(n=200_000)
    html, _ = page(d)
    assert len(html.encode()) < 500_000
    paths = re.findall(r'class="line \w+" d="([^"]+)"', html)
    assert len(paths) == 6
    for path in paths:
        assert 500 < len(re.findall("[ML]", path)) < 1500


def test_a_pause_is_a_gap_in_the_curve():
    html, _ = page(diagnosis(n=3000))
    paths = re.findall(r'class="line before" d="([^"]+)"', html)
    assert [p.count("M") for p in paths] == [1, 2, 1]


def test_intervals_are_shaded_within_the_chart():
    html, _ = page(diagnosis())
    bands = re.findall(r'class="band (\w+)" x="([\d.]+)" y="0" width="([\d.]+)"', html)
    assert {kind for kind, _, _ in bands} == {"located", "interval"}
    assert all(float(x) >= 0.0 and float(x) + float(w) <= 1000.0 for _, x, w in bands)


def test_names_from_outside_are_escaped():
    html, _ = page(diagnosis(note="<b>note</b>"), files=["<script>alert(1)</script>.tlog"])
    assert html.count("<script") == 1  # ours
    assert "&lt;script&gt;alert" in html
    assert "<b>" not in html


def test_parameters_are_named_for_ardupilot_only():
    assert "INS_ACCSCAL_X" in page(diagnosis())[1].words
    assert "INS_ACCSCAL_X" not in page(diagnosis(), autopilot="px4")[1].words


def luminance(colour: str) -> float:
    parts = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", [0, 1])
def test_text_is_readable_in_light_and_dark(scheme):
    html, _ = page(diagnosis())
    sets = re.findall(r":root \{(.*?)\}", html, re.DOTALL)
    colours = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", sets[scheme]))
    for ground in ("ground", "surface"):
        for ink in ("ink", "ink-soft", "before", "after", "good", "warn", "bad"):
            one, two = sorted((luminance(colours[ink]), luminance(colours[ground])))
            assert (two + 0.05) / (one + 0.05) >= 4.5, (ink, ground)


@pytest.mark.recordings
@pytest.mark.slow
def test_a_real_diagnosis(recordings: Path):
    result = explained(recordings / "sitl" / "i03.tlog")
    html = explain_html(
        result.diagnosis,
        files=result.files,
        autopilot=result.source.autopilot,
        duration_s=result.duration_s,
        advice=result.advice,
    )
    parsed = Page.of(html)
    assert len(html.encode()) < 500_000
    for e in result.diagnosis.effects:
        assert e.name in parsed.words


def test_paper_is_never_dark():
    html, _ = page(diagnosis())
    assert "@media screen and (prefers-color-scheme: dark)" in html
    assert "@media (prefers-color-scheme" not in html
