"""Evaluation of moved people: characters from ordinary photographs in other poses, compared with
the true person in the same poses."""
