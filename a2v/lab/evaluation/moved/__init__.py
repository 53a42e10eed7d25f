"""How good a person is who is moved: characters from ordinary photographs, put into other poses
beside the truth in the same poses."""
