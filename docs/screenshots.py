"""Makes the pictures that the README shows: the status page during the demo, and reports.

    python docs/screenshots.py [--reports] [FOLDER]

The demo runs in real time, so that charts have as many points as they have in a real flight: it
takes about ten minutes, on a computer that has nothing else to do.  ``--reports``: without it.

Needs a checkout with the development extras, chromium and chromedriver on PATH, and Pillow.
"""

from __future__ import annotations

import io
import json
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.effects import Effect, TemperatureDrift
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

Shot = tuple[str, int, int, str]
LIMIT_S = 900.0
FLIGHT_S = 300.0
SHOWN_AFTER_S = 170.0
"""Trusted flight after which the page in flight is taken."""
FLOWN_AGAIN_S = 40.0
BYTES_MAX = 150_000
COLOURS = 96
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)
IN_FLIGHT: tuple[Shot, ...] = (
    ("status-laptop.png", 1440, 900, "light"),
    ("status-phone.png", 390, 844, "light"),
    ("status-phone-dark.png", 390, 844, "dark"),
)
WRITTEN: tuple[Shot, ...] = (("written-laptop-dark.png", 1440, 900, "dark"),)
REPORT: Shot = ("report-laptop.png", 1180, 1000, "light")
EXPLAINED: Shot = ("explained-laptop.png", 1180, 1160, "light")
MATCHED: tuple[tuple[Shot, str], ...] = (
    (("match-laptop.png", 1180, 1160, "light"), "main"),
    (("match-curves.png", 1180, 1180, "light"), "#wind"),
)
"""And the part of the page that is at the top of the picture."""


def main(folder: Path, *, demo: bool) -> None:
    """The status page during the demo, if that is wanted, and reports."""
    folder.mkdir(parents=True, exist_ok=True)
    if demo:
        _take_demo(folder)
    with _browser() as browser, tempfile.TemporaryDirectory() as scratch:
        for command, effects, shot in (
            ("replay", (), REPORT),
            ("explain", (TemperatureDrift(x=0.02, y=-0.015, z=0.008),), EXPLAINED),
        ):
            browser.get(_report(Path(scratch), command, effects).as_uri())
            _take(browser, folder, shot)
        _take_match(browser, folder, _matched(Path(scratch)))


def _take_demo(folder: Path) -> None:
    """Run the demo, look at its page in flight and after the values are written."""
    port = _free_port()
    url = f"http://127.0.0.1:{port}"
    with _demo(port) as demo, _browser() as browser:
        _until(demo, lambda: _snapshot(url) is not None)
        browser.get(url)
        _until(demo, lambda: _trusted(url) > SHOWN_AFTER_S)
        for shot in IN_FLIGHT:
            _take(browser, folder, shot)
        _until(demo, lambda: len(_written(url)) == len(_imus(url)) > 0)
        landed = _trusted(url)
        _until(demo, lambda: _trusted(url) > landed + FLOWN_AGAIN_S)
        for shot in WRITTEN:
            _take(browser, folder, shot)


def _report(scratch: Path, verb: str, effects: tuple[Effect, ...]) -> Path:
    """The page of a simulated flight."""
    log, page = scratch / "flight.tlog", scratch / f"{verb}.html"
    truth = ImuTruth(scale=(1.021, 0.986, 1.013), offset=(0.21, -0.15, 0.3))
    spec = FlightSpec(vehicle="plane", duration=260.0, imus=(truth,), seed=3, effects=effects)
    write_tlog(spec, log)
    command = [sys.executable, "-m", "onboard", verb, str(log), "--report", str(page)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - ours
    return page


def _matched(scratch: Path) -> Path:
    """The page of a match: a copter with other rotors in wind that grows with height."""
    log, page = scratch / "copter.tlog", scratch / "match.html"
    air = Air.from_settings(5.0, 120.0, 0.5)
    aircraft = Aircraft(craft=Airframe().with_drag(mcoef=0.45), air=air)
    write_tlog(FlightSpec(duration=240.0, seed=5, aircraft=aircraft), log)
    command = [sys.executable, "-m", "onboard", "match", str(log), "--report", str(page)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - ours
    return page


def _take_match(browser: webdriver.Chrome, folder: Path, page: Path) -> None:
    for shot, top in MATCHED:
        browser.get(page.as_uri())
        browser.execute_script(f"document.querySelector('{top}').scrollIntoView()")
        _take(browser, folder, shot)


def _take(browser: webdriver.Chrome, folder: Path, shot: Shot) -> None:
    name, width, height, theme = shot
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
    )
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": theme}]},
    )
    time.sleep(1.5)  # a snapshot or two, drawn in the new size
    picture = Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")
    file = folder / name
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    size = file.stat().st_size
    sys.stdout.write(f"{file} {size} bytes\n")
    if size > BYTES_MAX:
        raise SystemExit(f"{file} has {size} bytes, more than {BYTES_MAX}")


def _snapshot(url: str) -> dict[str, Any] | None:
    try:
        with urllib.request.urlopen(f"{url}/api/snapshot", timeout=5.0) as answer:  # noqa: S310 - loopback
            document: dict[str, Any] = json.load(answer)
    except (urllib.error.URLError, ConnectionError, TimeoutError):
        return None
    return document


def _imus(url: str) -> list[dict[str, Any]]:
    snapshot = _snapshot(url)
    return [] if snapshot is None else list(snapshot["imus"])


def _trusted(url: str) -> float:
    """Least trusted flight that an accelerometer's answer rests on, s."""
    return min((float(imu["trusted_s"]) for imu in _imus(url)), default=0.0)


def _written(url: str) -> list[int]:
    snapshot = _snapshot(url)
    return [] if snapshot is None else list(snapshot["push"]["can_roll_back"])


def _until(demo: subprocess.Popen[bytes], condition: Callable[[], bool]) -> None:
    end = time.monotonic() + LIMIT_S
    while not condition():
        if demo.poll() is not None:
            raise SystemExit("the demo ended before the picture was taken")
        if time.monotonic() > end:
            raise SystemExit("the demo did not come so far")
        time.sleep(0.3)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def _demo(port: int) -> Iterator[subprocess.Popen[bytes]]:
    flight = ("--speedup", "1", "--duration", str(FLIGHT_S))
    command = [sys.executable, "-m", "onboard", "demo", "--port", str(port), *flight]
    demo = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # noqa: S603 - ours
    try:
        yield demo
    finally:
        demo.terminate()
        demo.wait()


@contextmanager
def _browser() -> Iterator[webdriver.Chrome]:
    options = Options()
    driver = shutil.which("chromedriver")
    options.binary_location = shutil.which("chromium") or ""
    if driver is None or not options.binary_location:
        raise SystemExit("chromium and chromedriver are not on PATH")
    with tempfile.TemporaryDirectory() as profile:
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        browser = webdriver.Chrome(options=options, service=Service(driver))
        try:
            yield browser
        finally:
            browser.quit()


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "--reports"]
    main(
        Path(given[0]) if given else Path(__file__).parent / "pictures",
        demo="--reports" not in sys.argv,
    )
