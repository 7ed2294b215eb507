"""What an import costs: the service imports this package, too."""

from __future__ import annotations

import subprocess
import sys

import pytest

import onboard
from onboard import api

HEAVY = ("numpy", "pymavlink", "msgspec", "jinja2", "matplotlib", "numba", "onboard.api")


def loaded_after(code: str) -> set[str]:
    """Modules that a fresh interpreter has loaded after some code."""
    said = subprocess.run(  # noqa: S603 - ours
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
        check=True,
        capture_output=True,
        text=True,
    )
    return set(said.stdout.split())


def test_importing_the_package_imports_nothing_of_weight():
    assert not loaded_after("import onboard; onboard.__version__; dir(onboard)") & set(HEAVY)


def test_asking_for_a_name_imports_neither_plots_nor_compiler_nor_service():
    loaded = loaded_after("import onboard; onboard.calibrate")
    assert "onboard.api" in loaded
    assert not loaded & {"matplotlib", "numba", "aiohttp", "onboard.daemon", "onboard.cli", "sitl"}


def test_every_name_is_there_and_says_what_it_is():
    assert set(onboard.__all__) == set(api.__all__)
    assert set(onboard.__all__) <= set(dir(onboard))
    for name in onboard.__all__:
        assert getattr(onboard, name) is getattr(api, name)
        assert (getattr(onboard, name).__doc__ or "").strip()


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'calibrated'"):
        _ = onboard.calibrated
