"""The simulator of an installed wheel: inside the product, and nowhere else."""

import sys
import tomllib
from pathlib import Path

from onboard.cli import simulator

ROOT = Path(__file__).resolve().parents[2]


def test_a_wheel_has_one_package():
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    wheel = wheel["targets"]["wheel"]
    assert wheel["packages"] == ["onboard"]
    installed = simulator.INSTALLED.relative_to(simulator.INSTALLED.parents[1])
    assert wheel["force-include"] == {"sitl": f"{installed}/sitl"}


def test_in_a_source_tree_nothing_is_put_on_the_path(monkeypatch):
    path = list(sys.path)
    simulator.make_importable()
    assert sys.path == path


def test_in_an_installation_its_folder_is(monkeypatch, tmp_path):
    monkeypatch.setattr(simulator, "find_spec", lambda _: None)
    monkeypatch.setattr(simulator, "INSTALLED", tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    simulator.make_importable()
    assert sys.path[-1] == str(tmp_path)
    monkeypatch.setattr(simulator, "INSTALLED", tmp_path / "none")
    path = list(sys.path)
    simulator.make_importable()
    assert sys.path == path
