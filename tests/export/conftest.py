"""Exports to ONNX."""

from tests.support.exports import one_table_of_operators

__all__ = ["one_table_of_operators"]
