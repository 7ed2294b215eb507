"""Tests of ``core.filter``."""
