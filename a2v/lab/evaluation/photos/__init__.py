"""Evaluation of characters from real photographs, which have no ground truth: sheets, the character
beside the photo, and grades by eye."""
