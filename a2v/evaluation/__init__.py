"""How good generated motions are: the papers' classifier metrics and physical plausibility."""
