"""Common parts of tests: fixtures (named in the root ``conftest.py``) and makers of small things."""
