"""Short logs, and workers that some of them kill."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import onboard
from onboard.batches.job import Job, version
from tests.recordings.dataflash_writer import modern_log

KILLER = """
import os, signal
import onboard.batches.worker as worker
plain = worker.done
def done(job, progress=None):
    if "killer" in job.file.name:
        os.kill(os.getpid(), signal.SIGKILL)
    return plain(job, progress)
worker.done = done
worker.main()
"""


def killed_by_some() -> subprocess.Popen[bytes]:
    """A worker that a log with ``killer`` in its name kills, as one that takes all memory."""
    root = str(Path(onboard.__file__).parents[1])
    return subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-c", KILLER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": root, "OPENBLAS_NUM_THREADS": "1"},
        start_new_session=True,
    )


def write(folder: Path, seconds: dict[str, int]) -> list[Path]:
    """Logs of these lengths by name."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, length in seconds.items():
        (folder / name).write_bytes(bytes(modern_log(length)))
    return [folder / name for name in seconds]


def jobs(paths: list[Path], **more: object) -> list[Job]:
    """What is to be done with them."""
    return [Job(path=os.fsencode(p), version=version(), **more) for p in paths]
