"""The site of the manuals holds without its generator: pages, links, what it may ask for."""

import importlib.util
import re
import tomllib
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def website():
    spec = importlib.util.spec_from_file_location("website", ROOT / "docs" / "website.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages(website):
    """Every page of the site, by its name there, with links as they are there."""
    manuals = {
        file.name: website.turned(
            file.read_text(encoding="utf-8"), PurePosixPath("docs", file.name)
        )
        for file in (ROOT / "docs").glob("*.md")
    }
    made = website.pages()
    assert not made.keys() & manuals.keys()
    return {**manuals, **made}


def test_the_navigation_has_every_page_once(pages):
    named = re.findall(r"^\s+- [^:]+: (\S+\.md)$", SETTINGS, re.MULTILINE)
    assert len(named) == len(set(named))
    assert set(named) == set(pages)


def test_links_between_pages_hold_after_they_were_turned(website, pages):
    outside = website.linked(pages)
    assert outside
    assert all(path.is_file() for path in outside.values())
    anchors = {
        name: {website.slug(title) for title in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
        for name, text in pages.items()
    }
    followed = 0
    for name, text in pages.items():
        for match in website.LINK.finditer(text):
            target, anchor = match[1], (match[2] or "").removeprefix("#")
            there = target in pages or target in outside or (ROOT / "docs" / target).is_file()
            assert there, f"{name}: {target}"
            assert not anchor or anchor in anchors[target], f"{name}: {target}#{anchor}"
            followed += 1
    assert followed > 50


def test_what_a_cell_showed_is_one_block(website):
    text = website.notebook((ROOT / "docs/notebook.ipynb").read_text(encoding="utf-8"))
    blocks = re.findall(r'<div class="shown">\n(.*?)\n</div>\n\n', text, re.DOTALL)
    assert len(blocks) >= 6
    for block in blocks:
        assert "\n\n" not in block  # an empty line ends a block of HTML in Markdown
    assert sum("<img alt=" in block for block in blocks) >= 2


def test_the_reference_has_every_public_name(website):
    import onboard  # noqa: PLC0415

    named = re.findall(r"^::: \S+\.(\w+)$", website.reference(), re.MULTILINE)
    assert sorted(named) == sorted(onboard.__all__)


def test_the_site_asks_nobody_for_anything():
    assert "font: false" in SETTINGS
    assert "generator: false" in SETTINGS
    assert "https:" not in SETTINGS
    assert "mermaid" not in SETTINGS  # would be loaded from elsewhere
    for file in [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs/site").iterdir()]:
        text = file.read_text(encoding="utf-8")
        assert "```mermaid" not in text, file
        assert not re.search(r"url\(|@import|<script", text), file


def test_the_lock_is_of_what_is_asked_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lock = (ROOT / "docs/site/requirements.lock").read_text(encoding="utf-8")
    locked = dict(re.findall(r"^([\w.-]+)==([\w.]+)", lock, re.MULTILINE))
    for wanted in project["optional-dependencies"]["site"]:
        assert re.match(r"[\w-]+", wanted)[0] in locked
    assert lock.count("==") <= lock.count("--hash=sha256:")
    assert "://" not in lock
