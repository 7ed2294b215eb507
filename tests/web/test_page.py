"""The status page in a real browser, against the daemon's HTTP server and a told story."""

import re

import pytest

from tests.web.story import story

STALE = ("WebSocket", "Failed to load resource")


@pytest.mark.slow
def test_one_glance_says_what_is_trusted_known_missing_and_next(browser, served):
    served.tell(story(40))
    browser.open(served.url)
    assert browser.text("#glance-trust .headline") == "Trusted"
    assert browser.text("#glance-imu-1 .headline") == "Learning"
    assert browser.text("#glance-imu-2 .detail") == "Least is known of the z offset."
    assert "Fly banked turns" in browser.text("#glance-next .headline")
    assert "SCALED_IMU2" in browser.text("#link-body")
    assert "slow" in browser.text("#link-body")
    assert "3, 120 ms at most" in browser.text("#link-body")


def test_values_change_as_snapshots_come(browser, served):
    browser.open(served.url)
    before = browser.text('[data-axis="x scale"] .value')
    served.tell(story(160))
    browser.until_says('[data-axis="x scale"] .value', "1.024")
    assert browser.text('[data-axis="x scale"] .value') != before
    assert browser.text("#glance-imu-1 .headline") == "Waits for your approval"
    assert browser.element('[data-axis="z offset"] canvas').size["height"] > 40


@pytest.mark.slow
def test_why_gps_is_not_trusted_is_said_in_words(browser, served):
    browser.open(served.url)
    trust = story(30).trust
    shut = type(trust)(
        phase="suspended",
        open=False,
        reason="jammed",
        reasons=("jammed", "few_satellites"),
        windows=1,
        trusted_s=30.0,
        rejected={},
    )
    served.tell(story(31), trust=shut)
    browser.until_says("#glance-trust .headline", "Not trusted")
    assert "jamming" in browser.text("#glance-trust .detail")
    assert "too few satellites" in browser.text("#glance-trust .detail")


@pytest.mark.slow
def test_each_accelerometer_has_its_tab_reached_by_keyboard(browser, served):
    served.tell(story(160))
    browser.open(served.url)
    assert "INS_ACCSCAL_X" in browser.text('[data-axis="x scale"]')
    browser.element("#tab-1").send_keys("\ue014")  # right arrow
    browser.until_says('[data-axis="x scale"]', "INS_ACC2SCAL_X")
    assert browser.run("return document.activeElement.id") == "tab-2"
    assert browser.element("#tab-2").get_attribute("aria-selected") == "true"


@pytest.mark.slow
def test_a_restart_of_the_service_is_said_and_survived(browser, served):
    served.tell(story(20))
    browser.open(served.url)
    served.stop()
    browser.until_says("#connection", "connection lost")
    assert "Connection lost" in browser.text("#banner")
    served.start()
    browser.until(lambda: browser.text("#connection") == "live")
    served.tell(story(160))
    browser.until_says("#glance-imu-1 .headline", "Waits for your approval")
    assert browser.element("#banner").get_attribute("hidden") is not None
    browser.expect_complaints(*STALE)


def test_text_from_outside_is_text(browser, served):
    browser.open(served.url)
    notice = type(story(0).notices[0])
    hostile = "<img src=x onerror=document.title='taken'>"
    served.tell(story(5), notices=(notice(at=0.0, kind="x", text=hostile),))
    browser.until_says("#journal-lines", hostile)
    assert browser.driver.title == "onboard"
    assert browser.elements("#journal-lines img") == []


def test_before_the_autopilot_is_heard_and_without_numbers_nothing_breaks(browser, served):
    link = story(0).link
    silent = type(link)(**{**_fields(link), "system_id": None, "armed": None, "messages": {}})
    served.tell(story(0, imus=0), link=silent)
    browser.open(served.url)
    browser.until_says("#glance-trust .headline", "No autopilot yet")
    unknown = story(1).imus[0]
    nothing = type(unknown.calibration)(
        **{**_fields(unknown.calibration), "scale": (None,) * 3, "scale_sigma": (None,) * 3}
    )
    view = type(unknown)(**{**_fields(unknown), "calibration": nothing, "certificate": None})
    served.tell(story(1), imus=(view,))
    browser.until_says('[data-axis="x scale"] .value', "no estimate yet")


@pytest.mark.slow
def test_a_day_does_not_make_the_page_grow(browser, served):
    browser.open(served.url)
    rows, first, last, every = browser.driver.execute_async_script(
        """const [seconds, done] = arguments;
        import('/static/history.js').then(({History}) => {
          const history = new History();
          let most = 0;
          for (let t = 0; t < seconds; t += 1) {
            history.add([t, t]);
            most = Math.max(most, history.length);
          }
          done([most, history.rows[0][0], history.rows.at(-1)[0], history.every]);
        });""",
        86_400,
    )
    assert rows <= 600
    assert (first, last) == (0, 86_399)
    assert every == pytest.approx(86_400 / rows, rel=1.0)
    served.tell(story(160))
    browser.until_says("#glance-imu-1 .headline", "Waits for your approval")
    before = browser.run("return document.getElementsByTagName('*').length")
    for second in range(161, 201):
        served.tell(story(second))
    browser.until_says("#glance-trust .detail", "3 min 20 s")
    assert browser.run("return document.getElementsByTagName('*').length") == before


@pytest.mark.slow
def test_charts_survive_a_reload_and_a_restart_of_the_service(browser, served):
    for second in range(0, 161, 20):
        served.tell(story(second))
    browser.open(served.url)
    browser.until_says("#axes-span", "2 min 20 s of trusted flight")
    served.stop()
    browser.until_says("#connection", "connection lost")
    served.start()
    browser.until_says("#connection", "live")
    browser.expect_complaints(*STALE)
    browser.open(served.url)
    browser.until_says("#axes-span", "2 min 20 s of trusted flight")
    served.tell(story(180))
    browser.until_says("#axes-span", "2 min 40 s")


@pytest.mark.slow
def test_the_page_is_light_and_asks_nobody_else(browser, served):
    browser.open(served.url)
    entries = browser.run(
        """return [...performance.getEntriesByType('resource'),
        ...performance.getEntriesByType('navigation')].map((e) => [e.name, e.decodedBodySize])"""
    )
    assert all(name.startswith(served.url) for name, _ in entries)
    assert 50_000 < sum(size for _, size in entries) < 300_000
    policy = browser.driver.execute_async_script(
        """const done = arguments[0];
        fetch('/').then((r) => done(r.headers.get('Content-Security-Policy')));"""
    )
    assert "unsafe" not in policy
    assert re.search(r"script-src 'self'", policy)


def _fields(record):
    return {name: getattr(record, name) for name in record.__struct_fields__}
