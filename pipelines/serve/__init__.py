"""The local web page: a server on 127.0.0.1, a queue in files, and child processes."""
