"""The engine: a graph of nodes that remembers results by content, resumes and fans out. It knows
nothing of what the graph computes."""
