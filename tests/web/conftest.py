"""A real browser, where there is one."""

import shutil

import pytest

from tests.web.browsing import Browser
from tests.web.page_server import PageServer

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")


@pytest.fixture(scope="session")
def _chromium(tmp_path_factory):
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no chromium and chromedriver on PATH (Debian: chromium, chromium-driver)")
    browser = Browser(CHROMIUM, DRIVER, tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.quit()


@pytest.fixture
def browser(_chromium):
    """The browser, blank; what a page wrote to its console must be nothing."""
    _chromium.blank()
    yield _chromium
    complaints = _chromium.complaints()
    _chromium.blank()
    assert complaints == []


@pytest.fixture
def served(tmp_path):
    """The page, served by the daemon's own HTTP server from a story that the test tells."""
    with PageServer(tmp_path) as server:
        yield server
