from __future__ import annotations

import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
# The writers of small recordings are shared with the readers' tests, snapshots with the stations'.
sys.path[:0] = [str(TESTS / "recordings"), str(TESTS / "gcs")]
