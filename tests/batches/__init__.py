"""Tests of ``batches``."""
