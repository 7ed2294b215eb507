"""Takes out of an installation what the service never imports: ``python deploy/slim.py FOLDER``.

FOLDER has the packages of onboard (``site-packages``).  For images and packages that are installed
as a whole; a virtual environment that pip is to manage further stays as it is.  What goes:

- of pymavlink, every dialect but the one that onboard speaks, its generator and log indexer;
- lxml, which pymavlink needs for its generator alone;
- tests and headers of numpy, and pip and setuptools, where they are.

``onboard`` is imported afterwards, with everything that the service and the commands use.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

DIALECT = "pymavlink/dialects/v20/ardupilotmega.py"
KEPT = frozenset({DIALECT, "pymavlink/dialects/__init__.py", "pymavlink/dialects/v20/__init__.py"})
NEEDLESS = (
    "pymavlink/dfindexer",
    "pymavlink/generator",
    "pymavlink/message_definitions",
    "pymavlink/tools",
    "lxml",
    "lxml-*.dist-info",
    "numpy/**/tests",
    "numpy/_core/include",
    "numpy/_core/lib",
    "numpy/f2py",
    "pip",
    "pip-*.dist-info",
    "pkg_resources",
    "setuptools",
    "setuptools-*.dist-info",
    "**/__pycache__",
)
PROOF = """
import onboard.api, onboard.mavlink.dialect, onboard.daemon.process.service, onboard.web.page
import aiohttp.web, aiomqtt, onboard.report.page
from onboard.cli.main import VERBS, cli
import click
for verb in VERBS:
    assert cli.get_command(click.Context(cli), verb) is not None, verb
"""


def slim(folder: Path) -> None:
    """Delete them, and prove that everything can still be imported."""
    for path in (folder / "pymavlink/dialects").rglob("*"):
        if path.is_file() and str(path.relative_to(folder)) not in KEPT:
            path.unlink()
    for pattern in NEEDLESS:
        for path in sorted(folder.glob(pattern), reverse=True):
            shutil.rmtree(path)
    subprocess.run([sys.executable, "-I", "-B", "-c", _proof(folder)], check=True)  # noqa: S603


def _proof(folder: Path) -> str:
    return f"import sys; sys.path.insert(0, {str(folder)!r}){PROOF}"


def megabytes(folder: Path) -> float:
    """What the files in it take, MB."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) / 1e6


def main() -> None:
    """Say what it saved."""
    folder = Path(sys.argv[1])
    before = megabytes(folder)
    slim(folder)
    sys.stdout.write(f"{folder}: {before:.0f} MB, now {megabytes(folder):.0f} MB\n")


if __name__ == "__main__":
    main()
