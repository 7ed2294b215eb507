"""Where the simulator is: beside the product in a source tree, inside it in an installation.

``sitl`` is no name that an installed package may take for itself.  So a wheel has it in a folder
of the product, which only the verbs that need it put on the path.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import onboard

INSTALLED = Path(onboard.__file__).parent / "simulator"


def make_importable() -> None:
    """From here on this process, and those that it starts for itself, can import ``sitl``."""
    if find_spec("sitl") is None and INSTALLED.is_dir():
        sys.path.append(str(INSTALLED))
