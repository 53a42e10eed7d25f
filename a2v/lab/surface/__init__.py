"""Networks of the implicit surface in PyTorch, and their training."""
