"""The commands of ``a2v``, one module each.

Each has ``HELP``, ``EXAMPLES``, ``Options`` and ``run(options) -> Answer``.
"""
