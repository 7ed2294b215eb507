"""Which process runs which tests: a file in one of them, and files that share work in the same."""

from __future__ import annotations

from xdist.scheduler import LoadFileScheduling

SHARED = {
    "tests/api/test_arrays.py": "one flight of the Python API",
    "tests/api/test_figures.py": "one flight of the Python API",
    "tests/api/test_manual.py": "one flight of the Python API",
    "tests/api/test_results.py": "one flight of the Python API",
    "tests/cli/test_replay_verb.py": "explained recordings",
    "tests/core/diagnosis/test_diagnosis.py": "explained recordings",
    "tests/report/test_one_answer.py": "explained recordings",
    "tests/report/test_recorded_advice.py": "explained recordings",
    "tests/report/test_report_page.py": "explained recordings",
}
"""Files that ask :mod:`tests.explained` for the same recordings, or fly the same flight."""


class SharedWork(LoadFileScheduling):
    """Files in the order of collection, which has the long ones first: the end is even."""

    def __init__(self, config, log=None):
        config.option.loadscopereorder = False
        super().__init__(config, log)

    def _split_scope(self, nodeid):
        file = super()._split_scope(nodeid)
        return SHARED.get(file, file)

    def remove_node(self, node):
        """A test that has ended its process has had its turn: the next process goes on after it."""
        units = self.assigned_work[node]
        pending = (test for unit in units.values() for test, done in unit.items() if not done)
        fatal = next(pending, None)
        for unit in units.values():
            unit.pop(fatal, None)
        self.assigned_work[node] = {k: u for k, u in units.items() if not all(u.values())}
        super().remove_node(node)
        return fatal
