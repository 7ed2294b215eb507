"""Tests of ``core.diagnosis``."""
