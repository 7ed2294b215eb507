"""Locks: every package with hashes; what the service needs is a part of what `make` installs."""

import importlib.util
import re
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]


def blocks(name):
    """(requirement, its hashes) of a lock, by the package's name."""
    text = re.sub(r"^#.*\n", "", (ROOT / name).read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = {}
    for line in text.replace("\\\n", " ").splitlines():
        requirement, *hashes = re.split(r"\s+--hash=", line.strip())
        parsed = Requirement(requirement)
        found[parsed.name] = (parsed, frozenset(hashes))
    return found


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", ROOT / "docs" / "licences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-service.lock"])
def test_every_package_has_one_version_and_hashes_and_no_address(name):
    assert "://" not in (ROOT / name).read_text(encoding="utf-8")
    for requirement, hashes in blocks(name).values():
        assert [one.operator for one in requirement.specifier] == ["=="]
        assert hashes
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", one) for one in hashes)


def test_the_services_lock_is_a_part_of_the_other():
    whole, part = blocks("requirements.lock"), blocks("requirements-service.lock")
    for name, (requirement, hashes) in part.items():
        assert whole[name][0].specifier == requirement.specifier
        assert whole[name][1] == hashes


def test_it_has_all_that_the_service_needs_and_nothing_else(licences):
    extra = {"numba", "llvmlite"}  # of ``fast``, which the service does without
    assert set(blocks("requirements-service.lock")) == set(licences.needed()) - extra
