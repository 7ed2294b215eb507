"""Tests of ``core.gps``."""
