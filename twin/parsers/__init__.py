"""The command line's parsers, one module a command, of the same name as its work in `twin.commands`; all light."""
