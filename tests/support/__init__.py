"""What several tests share: fixtures (named in the root ``conftest.py``) and makers of small
things."""
