"""Processes that replay recordings side by side, and survive each other.

Each has a thread that hands it a job and waits for what comes of it.  A process that dies, killed
by the system or by its log, costs this log: it is tried once more in a fresh process, for the
system may have taken memory from whoever had it, and then listed with the reason.
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec

import onboard
from onboard.batches.frames import Result, next_said, send
from onboard.batches.job import Job, Outcome
from onboard.threads import ONE_THREAD

Told = Callable[[int, float], None]
"""Told the number of a job and the share of it that is done."""
TRIES = 2
"""Of a log whose process has died: once may be for want of memory, twice is the log [cost]."""
_END_S = 5.0
"""s to wait for a process whose pipes are closed, before it is killed [cost]."""


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def outcomes(
    jobs: Sequence[Job], count: int, told: Told | None = None
) -> Iterator[tuple[int, Outcome]]:
    """Do jobs in ``count`` processes; number and outcome of each, as they are done."""
    waiting: queue.SimpleQueue[tuple[int, Job]] = queue.SimpleQueue()
    finished: queue.SimpleQueue[tuple[int, Outcome]] = queue.SimpleQueue()
    for item in enumerate(jobs):
        waiting.put(item)
    stop = threading.Event()
    hands = [_Hand(waiting, finished, told, stop) for _ in range(min(count, len(jobs)))]
    try:
        for hand in hands:
            hand.start()
        for _ in jobs:
            yield finished.get()
    finally:
        stop.set()
        for hand in hands:
            hand.end()


class _Hand(threading.Thread):
    """One process and who hands it its jobs."""

    def __init__(
        self,
        waiting: queue.SimpleQueue[tuple[int, Job]],
        finished: queue.SimpleQueue[tuple[int, Outcome]],
        told: Told | None,
        stop: threading.Event,
    ) -> None:
        super().__init__(daemon=True)
        self._waiting, self._finished, self._told, self._stop_set = waiting, finished, told, stop
        self._process: subprocess.Popen[bytes] | None = None

    def run(self) -> None:
        """Take jobs until there are none."""
        while not self._stop_set.is_set():
            try:
                number, job = self._waiting.get_nowait()
            except queue.Empty:
                break
            try:
                outcome = self._done(number, job)
            except Exception as error:  # noqa: BLE001 - whoever waits for it would wait for ever
                said = f"{type(error).__name__}: {error}"
                outcome = Outcome(error=f"{job.file}: could not be handed over ({said})")
            self._finished.put((number, outcome))
        self._dismiss()

    def end(self) -> None:
        """Let go of the process, in the middle of a job or not."""
        process = self._process
        if process is not None:
            process.kill()
        self.join(_END_S)

    def _done(self, number: int, job: Job) -> Outcome:
        why = ""
        for _ in range(TRIES):
            if self._stop_set.is_set():
                break
            outcome = self._tried(number, job)
            if isinstance(outcome, Outcome):
                return outcome
            why = outcome
        return Outcome(error=f"{job.file}: the process that replayed it {why}")

    def _tried(self, number: int, job: Job) -> Outcome | str:
        """The outcome, or how the process ended."""
        try:
            process = self._process = self._process or started()
        except OSError as error:
            return f"could not be started ({error.strerror})"
        if process.stdin is None or process.stdout is None:
            return "has no pipes"
        try:
            send(process.stdin, job)
            while (said := next_said(process.stdout)) is not None:
                if isinstance(said, Result):
                    return said.outcome
                if self._told is not None:
                    self._told(number, said.done)
        except (OSError, msgspec.DecodeError):  # it has ended, or what it said is no message
            pass
        self._dismiss()
        return ending(process.returncode)

    def _dismiss(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()


def started() -> subprocess.Popen[bytes]:
    """A process that waits for jobs; an interrupt on the terminal is not for it."""
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1")
    here = str(Path(onboard.__file__).parents[1])
    before = environment.get("PYTHONPATH")
    environment["PYTHONPATH"] = here if not before else here + os.pathsep + before
    return subprocess.Popen(
        [sys.executable, "-m", "onboard.batches.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
    )


def ending(status: int | None) -> str:
    """How a process ended, in words."""
    if status is None:
        return "fell silent"
    if status >= 0:
        return f"ended with status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    return f"was killed ({name})"
