"""No page breaks a rule of axe: status page and reports, at three widths, light and dark.

axe-core is not part of the project: ``npm ci --prefix tests/axe`` puts it beside the tests, and
without it they are skipped.
"""

from pathlib import Path

import pytest

from onboard.report.explain import explain_html
from onboard.report.fleet import fleet_html
from onboard.report.match import match_html
from onboard.report.replay import replay_html
from tests.report.diagnoses_by_hand import advice_on, diagnosis
from tests.report.matches_by_hand import by_hand
from tests.web.reports import flown_fleet, replayed
from tests.web.story import DIAGNOSIS, story

AXE = Path(__file__).resolve().parents[1] / "axe/node_modules/axe-core/axe.min.js"
WIDTHS = [(390, 844), (820, 1180), (1440, 900)]
THEMES = ["light", "dark"]
RUN = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations']}).then((found) => done({
  rules: found.passes.length,
  broken: found.violations.map((v) => [v.id, v.help, v.nodes.map((n) => n.html.slice(0, 120))]),
})).catch((error) => done({rules: 0, broken: [String(error)]}));
"""


def explained():
    made = diagnosis()
    return explain_html(
        made,
        files=("flight.BIN",),
        autopilot="ardupilot",
        duration_s=300.0,
        advice=advice_on(made),
    )


REPORTS = {
    "explain": explained,
    "match": lambda: match_html(by_hand()),
    "fleet": lambda: fleet_html(*flown_fleet()),
    "replay": lambda: replay_html(*replayed()),
}


def broken(browser):
    if not AXE.is_file():
        pytest.skip("no axe-core (npm ci --prefix tests/axe)")
    browser.run(AXE.read_text(encoding="utf-8"))
    said = browser.driver.execute_async_script(RUN)
    assert said["rules"] > 15 or said["broken"]
    return said["broken"]


def fits(browser, width):
    return browser.run("return document.documentElement.scrollWidth") <= width


@pytest.mark.slow
@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("size", WIDTHS, ids=lambda size: str(size[0]))
def test_the_status_page(browser, served, size, theme):
    served.tell(story(160), diagnosis=DIAGNOSIS)
    browser.size(size)
    browser.theme(theme)
    browser.open(served.url)
    browser.until(lambda: browser.elements("canvas"))
    assert broken(browser) == []
    assert fits(browser, size[0])


@pytest.mark.slow
@pytest.mark.parametrize("name", REPORTS)
def test_a_report(browser, tmp_path, name):
    page = tmp_path / f"{name}.html"
    page.write_text(REPORTS[name](), encoding="utf-8")
    for size in WIDTHS:
        for theme in THEMES:
            browser.size(size)
            browser.theme(theme)
            browser.driver.get(page.as_uri())
            assert broken(browser) == [], (size, theme)
            assert fits(browser, size[0]), (size, theme)
