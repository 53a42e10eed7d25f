"""Many videos at once: reading the jobs, doing them on workers that may die, and the tables of what
came out."""
