"""Headless Chromium as the tests use it."""

from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

LIMIT_S = 400.0  # only ends a hopeless test
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
)
PHONE, LAPTOP = (390, 844), (1440, 900)


class Browser:
    """One browser process; pages are opened one after another."""

    def __init__(self, chromium, driver, profile):
        options = Options()
        options.binary_location = chromium
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(driver))

    def quit(self):
        self.driver.quit()

    def blank(self):
        self.driver.get("about:blank")
        self.driver.get_log("browser")
        self.size(LAPTOP)
        self.theme("light")

    def complaints(self):
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def expect_complaints(self, *about):
        """Take out what the test provoked; whatever else there is stays an error."""
        others = [c for c in self.complaints() if not any(text in c for text in about)]
        assert others == []

    def size(self, wanted):
        width, height = wanted
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
        )

    def theme(self, name):
        self.driver.execute_cdp_cmd(
            "Emulation.setEmulatedMedia",
            {"features": [{"name": "prefers-color-scheme", "value": name}]},
        )

    def open(self, url):
        self.driver.get(url)
        self.until(lambda: self.text("#connection") == "live")

    def element(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def elements(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def text(self, selector):
        return self.element(selector).get_attribute("textContent")

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def until(self, condition):
        WebDriverWait(
            self.driver,
            LIMIT_S,
            poll_frequency=0.05,
            ignored_exceptions=[StaleElementReferenceException],
        ).until(lambda _: condition())

    def until_says(self, selector, words):
        self.until(lambda: words in self.text(selector))
