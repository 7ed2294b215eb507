"""The command line: :mod:`onboard.cli.main` is the door, each verb has a module of its own."""
