"""Tests of ``core.fleet``."""
