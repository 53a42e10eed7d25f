"""The engine: run any graph of nodes, store results by content, resume, and use many processes."""
