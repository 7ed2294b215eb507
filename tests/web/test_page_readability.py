"""The page can be read and used: on a phone, in the dark, by keyboard."""

import pytest

from tests.web.browsing import LAPTOP, PHONE
from tests.web.story import DIAGNOSIS, story

# WCAG 2 contrast of every visible piece of text against the nearest painted ground behind it.
CONTRASTS = """
const channel = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const parsed = (text) => text.match(/[\\d.]+/g).map(Number);
const light = ([r, g, b]) =>
  0.2126 * channel(r / 255) + 0.7152 * channel(g / 255) + 0.0722 * channel(b / 255);
const ground = (e) => {
  for (let at = e; at; at = at.parentElement) {
    const colour = parsed(getComputedStyle(at).backgroundColor);
    if (colour.length === 3 || colour[3] === 1) return colour;
  }
  return [255, 255, 255];
};
const below = [];
let seen = 0;
for (const e of document.querySelectorAll('body *')) {
  const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
  if (!own || !e.getClientRects().length) continue;
  seen += 1;
  const [a, b] = [light(parsed(getComputedStyle(e).color)), light(ground(e))];
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (ratio < 4.5) below.push([e.className, e.textContent.slice(0, 40), ratio]);
}
return {seen, below};
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "labels"),
    [
        ([0, 10, 20], ["0", "10", "20 s"]),
        ([0, 180, 360], ["0", "3", "6 min"]),
        ([0, 30, 60, 90], ["0", "30", "60", "90 s"]),
        ([0, 3600, 7200], ["0", "1", "2 h"]),
    ],
)
def test_the_time_axis_has_its_unit(browser, served, seconds, labels):
    browser.open(served.url)
    shown = browser.driver.execute_async_script(
        """const [seconds, done] = arguments;
        import('/static/charts.js').then(({elapsed}) => done(elapsed(seconds)));""",
        seconds,
    )
    assert shown == labels


@pytest.mark.slow
@pytest.mark.parametrize("size", [PHONE, LAPTOP])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_it_fits_and_can_be_read(browser, served, size, theme):
    served.tell(story(160), diagnosis=DIAGNOSIS)
    browser.size(size)
    browser.theme(theme)
    browser.open(served.url)
    browser.until(lambda: browser.elements("canvas"))
    assert browser.run("return document.documentElement.scrollWidth") <= size[0]
    poor = browser.run(CONTRASTS)
    assert poor["seen"] > 60
    assert poor["below"] == []
    small = browser.run(
        """return [...document.querySelectorAll('button')].filter((e) => e.offsetHeight &&
        (e.offsetHeight < 30 || e.offsetWidth < 30)).map((e) => e.textContent)"""
    )
    assert small == []


@pytest.mark.slow
def test_everything_that_can_be_done_can_be_reached_by_tabulator(browser, served):
    served.tell(story(160))
    browser.open(served.url)
    reached = set()
    for _ in range(30):
        browser.run("return document.activeElement").send_keys("\ue004")
        reached.add(
            browser.run(
                "const e = document.activeElement; return e.dataset.key || e.id || e.tagName"
            )
        )
    assert {"tab-1", "approve-1", "reject-1", "approve-2", "reject-2", "reset-"} <= reached
    assert {"SUMMARY", "journal-lines"} <= reached


@pytest.mark.slow
def test_what_happened_last_stands_first_whatever_the_clock_was_set_to(browser, served):
    browser.open(served.url)
    names = browser.driver.execute_async_script(
        """const done = arguments[0];
        const line = (text, at, earlier = false) => ({ text, at, earlier });
        const before = [line("of yesterday", 500, true), line("as well", 900, true)];
        import('/static/link.js').then(({inOrder}) => done(inOrder(
          [...before, line("begins", 120), line("is written", 5120), line("is done", 20)],
          [line("found", 100), line("trusted", 5110), line("clock set back", 10)],
        ).map((one) => one.text)));"""
    )
    assert names[-2:] == ["as well", "of yesterday"]
    ours = names[:-2]
    assert [n for n in ours if n in {"begins", "is written", "is done"}] == [
        "is done",
        "is written",
        "begins",
    ]
    assert [n for n in ours if n in {"found", "trusted", "clock set back"}] == [
        "clock set back",
        "trusted",
        "found",
    ]
