"""The commands of ``a2v``, one module each: ``HELP``, ``EXAMPLES``, ``Options``, ``run(options) ->
Answer``."""
