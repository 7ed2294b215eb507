"""Tests of ``core.estimate``."""
