from __future__ import annotations

import sys
from pathlib import Path

# The writers of small recordings are shared with the readers' tests.
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "recordings"))
