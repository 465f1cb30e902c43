"""The commands of `twin`, one module each, imported when called: `run(arguments) -> exit code`."""
