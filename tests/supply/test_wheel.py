"""The wheel: the same bytes from the same source, one package in it, and it runs offline."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ("onboard", "sitl", "pyproject.toml", "LICENSE", "README.md", ".gitignore")
LONG_AGO = 1_000_000_000
"""Unix time, s."""


def copied(folder):
    """What a wheel is made of, without what lies about in a work tree."""
    folder.mkdir()
    for name in SOURCE:
        source = ROOT / name
        if source.is_dir():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, folder / name, ignore=ignored)
        else:
            shutil.copy(source, folder / name)
    return folder


def wheel_of(source, into):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(into)]
    environment = {k: v for k, v in os.environ.items() if k != "SOURCE_DATE_EPOCH"}
    subprocess.run(command, cwd=source, env=environment, check=True, capture_output=True)  # noqa: S603 - this Python
    (wheel,) = into.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A wheel house with this wheel in it."""
    folder = tmp_path_factory.mktemp("wheel")
    return wheel_of(copied(folder / "source"), folder / "house").parent


@pytest.fixture(scope="module")
def wheel(house):
    (wheel,) = house.iterdir()
    return wheel


@pytest.mark.slow
def test_another_day_another_umask_and_another_folder_give_the_same_bytes(wheel, tmp_path):
    again = copied(tmp_path / "elsewhere")
    (again / "onboard" / "__pycache__").mkdir()
    (again / "onboard" / "__pycache__" / "left.cpython-311.pyc").write_bytes(b"left over")
    for path in again.rglob("*"):
        path.chmod(0o700 if path.is_dir() else 0o600)
        os.utime(path, (LONG_AGO, LONG_AGO))
    assert wheel_of(again, tmp_path / "dist").read_bytes() == wheel.read_bytes()


def test_it_has_one_package_of_its_own_name_and_what_a_service_needs(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"onboard"}
    assert {"onboard/systemd/onboard.service", "onboard/systemd/onboard.toml"} <= set(names)
    assert "onboard/simulator/sitl/__init__.py" in names
    assert not [name for name in names if name.endswith((".pyc", ".tlog", ".BIN"))]
    # All that is in the source is in it: pages, styles, lists of words.
    source = {p.relative_to(ROOT).as_posix() for p in (ROOT / "onboard").rglob("*") if p.is_file()}
    assert {name for name in source if "__pycache__" not in name} <= set(names)


@pytest.mark.slow
def test_it_is_installed_from_a_folder_and_runs_from_there(house, tmp_path):
    """Without an index; what it needs besides is what these tests run with."""
    target = tmp_path / "site"
    install = ["-m", "pip", "install", "--no-index", "--find-links", str(house), "--no-deps"]
    options = ["--target", str(target), "--disable-pip-version-check", "onboard-calibration"]
    subprocess.run(  # noqa: S603 - this Python
        [sys.executable, *install, *options], cwd=tmp_path, check=True, capture_output=True
    )
    code = (
        "import onboard, sys; from onboard.cli.main import run; print(onboard.__file__); "
        "sys.exit(run(['service', 'show']) or run(['sim', '--help']) or run(['demo', '--help']))"
    )
    result = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(target), "PYTHONSAFEPATH": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    lines = result.stdout.splitlines()
    assert Path(lines[0]).is_relative_to(target)
    assert "WatchdogSec=30" in lines
