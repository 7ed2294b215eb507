"""Tests of ``core.physics``."""
