"""No page breaks a rule of axe: status page and reports, at three widths, light and dark.

axe-core is not part of the project: ``npm ci --prefix tests/axe`` puts it beside the tests, and
without it they are skipped.
"""

from pathlib import Path

import msgspec
import pytest

from onboard.answers.explain_document import explain_document
from onboard.core.diagnosis.records import Verdict
from onboard.core.physics.finding import Quantity
from onboard.report.explain import explain_html
from onboard.report.fleet import fleet_html
from onboard.report.match import match_html
from onboard.report.replay import replay_html
from tests.report.diagnoses_by_hand import advice_on, diagnosis, effect, told_apart_not, unknown
from tests.report.matches_by_hand import by_hand
from tests.web.reports import flown_fleet, replayed
from tests.web.story import story, wrote

AXE = Path(__file__).resolve().parents[1] / "axe/node_modules/axe-core/axe.min.js"
LOOKS = [
    ((390, 844), "light"),
    ((390, 844), "dark"),
    ((820, 1180), "light"),
    ((1440, 900), "dark"),
]
"""Where things are does not depend on the theme; a telephone has least room in either."""
RUN = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations']}).then((found) => done({
  rules: found.passes.length,
  broken: found.violations.map((v) => [v.id, v.help, v.nodes.map((n) => n.html.slice(0, 120))]),
})).catch((error) => done({rules: 0, broken: [String(error)]}));
"""


def explained(made):
    return explain_html(
        made,
        files=("flight.BIN",),
        autopilot="ardupilot",
        duration_s=300.0,
        advice=advice_on(made),
    )


def of_every_severity():
    """Worth knowing, matters, dangerous."""
    return diagnosis(
        effects=(
            effect(),
            effect("cross_axis", unknowns={"xy": Quantity(0.02, 0.001, "1")}),
            effect("saturation", unknowns={"limit": Quantity(78.5, 0.0, "m/s^2")}),
        )
    )


REPORTS = {
    "explain": lambda: explained(diagnosis()),
    "dangerous": lambda: explained(of_every_severity()),
    "not told apart": lambda: explained(told_apart_not()),
    "nothing known": lambda: explained(unknown()),
    "too little flown": lambda: explained(diagnosis(verdict=Verdict.INSUFFICIENT, effects=())),
    "match": lambda: match_html(by_hand()),
    "fleet": lambda: fleet_html(*flown_fleet()),
    "replay": lambda: replay_html(*replayed()),
}


def on_page(made):
    """A diagnosis as the status page is given it."""
    document = explain_document(
        made, files=["flight.BIN"], autopilot="ardupilot", duration_s=300.0, samples={}
    )
    return msgspec.to_builtins(document)


def waiting(served, browser):
    """Nobody has been heard."""
    silent = msgspec.structs.replace(story(0).link, system_id=None, armed=None, messages={})
    served.tell(story(0, imus=0), link=silent)
    browser.open(served.url)
    browser.until_says("#glance-trust .headline", "No autopilot yet")


def to_approve(served, browser):
    served.tell(story(160), diagnosis=on_page(of_every_severity()))
    browser.open(served.url)
    browser.until(lambda: browser.elements("canvas"))


def asked(served, browser):
    """The question before something is written."""
    to_approve(served, browser)
    browser.element('[data-imu="1"] [data-action="approve"]').click()
    browser.until(lambda: browser.element("#confirm").is_displayed())


def written(served, browser):
    served.tell(story(160), push=wrote(story(160).push))
    browser.open(served.url)
    browser.until_says("#written-body", "What to do next")


STATES = (waiting, to_approve, asked, written)


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
@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
def test_the_status_page(browser, served, state):
    for size, theme in LOOKS:
        browser.size(size)
        browser.theme(theme)
        state(served, browser)
        assert broken(browser) == [], (size, theme)
        assert fits(browser, size[0]), (size, theme)


@pytest.mark.slow
@pytest.mark.parametrize("name", REPORTS)
def test_a_report(browser, tmp_path, name):
    page = tmp_path / "report.html"
    page.write_text(REPORTS[name](), encoding="utf-8")
    for size, theme in LOOKS:
        browser.size(size)
        browser.theme(theme)
        browser.driver.get(page.as_uri())
        assert broken(browser) == [], (size, theme)
        assert fits(browser, size[0]), (size, theme)
