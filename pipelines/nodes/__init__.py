"""Nodes: each loads its refs, calls one pure function of `a2v` and stores the result; none knows
the engine."""
