"""The commands of ``a2v``, one module each: ``HELP``, ``EXAMPLES``, ``add_arguments(parser)``, ``run(settings) -> int``."""
