"""Tests of `a2v.footage`."""
