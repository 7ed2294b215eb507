"""``python -m benchmarks.matching``."""

from benchmarks.matching.runner import main

main()
