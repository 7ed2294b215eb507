"""Charts of a report can be read off and looked into; what is read is what was drawn."""

import re

import numpy as np
import pytest
from jinja2 import ChoiceLoader, FileSystemLoader, PackageLoader
from selenium.webdriver import ActionChains

from onboard.report.chart import Line, line_chart
from onboard.report.page import render

T = np.arange(0.0, 600.0, 0.5)
SLOPE = T / 100.0 - 3.0


@pytest.fixture
def charts(browser, tmp_path, monkeypatch):
    """Two charts of one time and one of something else, in a page of the reports' look."""
    torn = np.where((T > 270.0) & (T < 330.0), np.nan, 2.0)
    lines = [
        Line(T, SLOPE, "before", "before"),
        Line(T, 0.0 * T + 1.0, "after", "after"),
        Line(T, torn, "bound", "torn"),
    ]
    drawn = [line_chart(title, "m/s", lines) for title in ("North", "East")]
    x = np.linspace(20.0, 50.0, 31)
    drawn.append(
        line_chart("Law", "m/s²", [Line(x, x / 50.0, "one", "x")], x_label="heat", x_unit="°C")
    )
    (tmp_path / "t.html.j2").write_text(
        "{% extends base %}{% block title %}t{% endblock %}"
        "{% block main %}<h1>t</h1>{% for c in charts %}{{ c }}{% endfor %}{% endblock %}"
    )
    monkeypatch.setattr(
        "onboard.report.page.PackageLoader",
        lambda *given: ChoiceLoader([PackageLoader(*given), FileSystemLoader(tmp_path)]),
    )
    page = tmp_path / "page.html"
    page.write_text(render("t.html.j2", charts=drawn), encoding="utf-8")
    browser.driver.get(page.as_uri())
    return browser.elements(".plot")


def point(browser, plot, share, *, then=lambda chain: chain):
    """Put the pointer over a chart, at a share of its width."""
    width = plot.size["width"]
    chain = ActionChains(browser.driver, duration=0)
    then(chain.move_to_element_with_offset(plot, round((share - 0.5) * width), 0)).perform()


def told(plot):
    text = plot.find_element("css selector", ".readout").text.replace("\u2212", "-")
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text)]


def marks(plot):
    return [
        float(tick.text.replace("\u2212", "-"))
        for tick in plot.find_elements("css selector", ".tick.x")
        if tick.is_displayed()
    ]


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.37, 0.9])
def test_the_cursor_reads_what_was_drawn(browser, charts, share):
    point(browser, charts[0], share)
    minutes, before, after, torn = told(charts[0])
    assert minutes == pytest.approx(share * 10.0, abs=0.05)  # a pixel or two of some 1100
    assert before == pytest.approx(minutes * 0.6 - 3.0, abs=0.03)
    assert after == pytest.approx(1.0, abs=0.03)
    assert torn == pytest.approx(2.0, abs=0.03)


@pytest.mark.slow
def test_in_a_gap_there_is_nothing_to_read(browser, charts):
    point(browser, charts[0], 0.5)
    assert charts[0].find_element("css selector", ".readout").text.endswith("torn \u2013")
    assert len(told(charts[0])) == 3


@pytest.mark.slow
def test_charts_of_one_time_are_looked_into_together_and_others_stay(browser, charts):
    whole = [marks(plot) for plot in charts]
    a_fifth = round(0.2 * charts[0].size["width"])

    def drag(chain):
        return chain.click_and_hold().move_by_offset(a_fifth, 0).release()

    point(browser, charts[0], 0.4, then=drag)
    for plot in charts[:2]:
        seen = marks(plot)
        assert len(seen) >= 3
        assert all(3.9 < minute < 6.1 for minute in seen)
    assert marks(charts[2]) == whole[2]
    point(browser, charts[1], 0.5)
    assert told(charts[1])[0] == pytest.approx(5.0, abs=0.05)
    point(browser, charts[1], 0.5, then=lambda chain: chain.double_click())
    assert [marks(plot) for plot in charts] == whole


@pytest.mark.slow
def test_values_are_read_by_keyboard_too(browser, charts):
    charts[0].send_keys("\ue014")  # right
    first = told(charts[0])[0]
    charts[0].send_keys("\ue014")
    assert told(charts[0])[0] > first
    charts[0].send_keys("\ue00c")  # escape
    assert not charts[0].find_element("css selector", ".readout").is_displayed()


@pytest.mark.slow
def test_the_hint_is_there_only_where_the_script_runs(browser, charts):
    assert browser.element("#reading").is_displayed()
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.driver.refresh()
        assert not browser.element("#reading").is_displayed()
        assert len(browser.elements(".plot path.line")) == 7
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
