"""The example notebook: its cells run in order, and what is stored is what they show."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib (the extra plot) is absent")
ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "docs" / "notebook.ipynb"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def stored():
    return json.loads(FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def run(stored, tmp_path_factory):
    """The notebook executed anew, and what its cells have left."""
    spec = importlib.util.spec_from_file_location("notebook", ROOT / "docs" / "notebook.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    names = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("notebook"))
        return module.executed(stored, names), names


def shown(notebook):
    """What each cell shows, by kind."""
    return [
        [sorted(o.get("data", {"stream": ""})) for o in cell.get("outputs", ())]
        for cell in notebook["cells"]
    ]


def texts(notebook):
    return [
        "".join(o.get("text") or o["data"]["text/plain"])
        for cell in notebook["cells"]
        for o in cell.get("outputs", ())
    ]


def test_what_is_stored_is_what_the_cells_show(stored, run):
    done, _ = run
    assert shown(done) == shown(stored)
    # The same words; numbers of another machine may differ in their last digits.
    number = r"-?\d+(\.\d+)?(e-?\d+)?"
    for new, old in zip(texts(done), texts(stored), strict=True):
        assert re.sub(number, "#", new).split() == re.sub(number, "#", old).split()


def test_it_finds_the_truth_that_it_has_made(run):
    _, names = run
    imu, truth = names["imu"], names["truth"]
    assert np.all(np.abs(imu.scale - truth.scale) < 4.0 * imu.scale_sigma)
    assert np.all(np.abs(imu.offset - truth.offset) < 4.0 * imu.offset_sigma)


def test_it_is_small_and_names_no_machine(stored):
    text = FILE.read_text(encoding="utf-8")
    assert len(text) < 150_000
    assert not re.search(r"/(?:home|root|tmp|work|Users)/|https?:|\\\\Users", text)
    code = [cell for cell in stored["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    assert len({cell["id"] for cell in stored["cells"]}) == len(stored["cells"])
