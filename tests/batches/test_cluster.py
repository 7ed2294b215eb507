"""The same on a cluster of two processes, of which one is lost in the middle."""

from __future__ import annotations

import logging
import os
import signal
import sys

import msgspec
import pytest

from onboard.batches import cluster as batches
from onboard.batches.cluster import imported, on_cluster
from onboard.batches.crew import outcomes
from onboard.errors import LinkError, UsageError
from tests.batches.logs import jobs, write

ENCODE = msgspec.msgpack.encode


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process; what they say of those that are lost is not for the test."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as its:
        yield its


def busy(cluster) -> int:
    """Process of a worker that is in the middle of a batch."""
    distributed = pytest.importorskip("distributed")
    processing = distributed.default_client().processing()
    return next(w.pid for w in cluster.workers.values() if processing.get(w.worker_address))


@pytest.mark.slow
def test_a_lost_worker_changes_nothing(cluster, tmp_path):
    paths = write(tmp_path, {f"{k}.BIN": 4 + k for k in range(4)})
    work = jobs(paths)
    local = dict(outcomes(work, 1))
    found, lost = {}, None
    for number, outcome in on_cluster(cluster.scheduler_address, work, per_batch=1):
        found[number] = outcome
        if lost is None:
            lost = busy(cluster)
            os.kill(lost, signal.SIGKILL)
    assert sorted(found) == list(range(4))
    for number, outcome in found.items():
        assert outcome.error == ""
        assert ENCODE(outcome.record) == ENCODE(local[number].record)


class Workers:
    """A client whose workers answer so."""

    def __init__(self, answer):
        self.answer = answer

    def run(self, _function):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.mark.parametrize(
    ("answer", "error", "said"),
    [
        ({}, LinkError, "no workers"),
        ({"w": "0.0-old"}, UsageError, "w runs another version"),
        (ModuleNotFoundError("No module named 'onboard'"), UsageError, "lack onboard"),
    ],
)
def test_workers_that_would_give_other_numbers_are_refused(answer, error, said):
    with pytest.raises(error, match=said):
        batches._same_version(Workers(answer), "tcp://a:1")


def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr(batches, "CONNECT_S", 0.5)
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with pytest.raises(LinkError, match="no scheduler answers"):
        list(on_cluster("tcp://127.0.0.1:9", jobs([]), 2))


def test_without_distributed_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"onboard-calibration\[dask\]"):
        imported()
