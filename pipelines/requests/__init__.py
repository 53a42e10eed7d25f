"""Requests for a video and for its parts: person, motion and film.

Command line, tables, page and Python all make these objects.
"""
