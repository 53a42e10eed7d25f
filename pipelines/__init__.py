"""The pipeline: store, nodes, graph, run, executors, the command line; thin over `a2v`."""
