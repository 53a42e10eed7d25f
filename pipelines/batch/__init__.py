"""Make many videos: read jobs, run them on workers that may die, and write tables of results."""
