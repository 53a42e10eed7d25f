"""Run the pipeline: store, nodes, graph, executors and the command line around `a2v`."""
