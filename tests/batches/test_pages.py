"""Pages go by the content of a recording, and show the name that it has."""

from __future__ import annotations

import gzip
import html
import os
from pathlib import Path

import pytest

from onboard.batches.job import Outcome, content, done
from tests.batches.logs import jobs, write

NAMES = ("old.BIN", "a & <b> 'c' \"d\".BIN")


def page(path: Path, store: Path | None) -> tuple[Outcome, str]:
    (job,) = jobs([path], paged=True, store="" if store is None else str(store))
    outcome = done(job)
    assert not outcome.error
    return outcome, gzip.decompress(outcome.page).decode()


@pytest.mark.parametrize("name", NAMES)
def test_a_page_names_its_file_with_a_store_or_without(tmp_path, name):
    (path,) = write(tmp_path / "logs", {name: 4})
    path.write_bytes(path.read_bytes() + b"cut off")  # so that damage is told, by the file's name
    pages = [page(path, store)[1] for store in (None, tmp_path / "store", tmp_path / "store")]
    assert len(set(pages)) == 1
    assert html.unescape(pages[0]).count(f"{name}: ") >= 1
    assert content(path) not in pages[0]


def test_a_page_that_was_kept_has_the_name_that_the_file_has_now(tmp_path):
    """Renamed, moved, or another file with the same content: each has a page of its own."""
    (path,) = write(tmp_path / "logs", {NAMES[0]: 4})
    _, first = page(path, tmp_path / "store")
    new = path.rename(tmp_path / "new.BIN")
    copy = Path(os.fsdecode(os.fsencode(tmp_path / "no-") + b"\xff.BIN"))
    copy.write_bytes(new.read_bytes())
    for file, shown in ((new, "new.BIN"), (copy, "no-?.BIN"), (new, "new.BIN")):
        outcome, text = page(file, tmp_path / "store")
        assert outcome.stored
        assert text == first.replace(NAMES[0], shown)
        assert text != first
