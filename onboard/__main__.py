"""``python -m onboard``."""

from onboard.cli.main import main

main()
