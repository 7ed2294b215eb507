"""Tests of ``gcs``."""
