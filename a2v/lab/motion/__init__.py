"""Networks of the motion models in PyTorch, their training, and the baselines of the papers."""
