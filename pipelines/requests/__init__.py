"""What is asked for: a video, and its parts person, motion and film. Command line, tables, page and
Python all make these."""
