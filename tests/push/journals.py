"""Entries of a journal, and how a test writes and reads one."""

from onboard.push.entries import Closed, Planned, Purpose, ReadBack, Result, Writing
from onboard.push.journal import Journal
from tests.push.pushing import make_plan

PLAN = make_plan()


def closed(name, result=Result.COMPLETED):
    return Closed(name, result, "none", "said so", PLAN.wanted)


def story(name, imu=1, result=Result.COMPLETED, purpose=Purpose.PUSH):
    plan = make_plan(imu=imu)
    first, second = plan.names[:2]
    return [
        Planned(name, plan, purpose),
        Writing(name, first, plan.before[first], plan.wanted[first]),
        ReadBack(name, first, plan.wanted[first], saved=True),
        Writing(name, second, plan.before[second], plan.wanted[second]),
        closed(name, result),
    ]


def write(path, entries, **kwargs):
    with Journal(path, **kwargs) as journal:
        for i, entry in enumerate(entries):
            journal.append(entry, 1000.0 + i)


def read(path):
    with Journal(path) as journal:
        return [e for _, e in journal.entries], journal.recover(), journal.damaged
