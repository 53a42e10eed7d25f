"""Nodes: each loads its refs, calls one pure function of `a2v` and stores the result.

None of them depends on the engine's executors.
"""
