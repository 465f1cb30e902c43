"""The command `twin`: plan a run, perform it, replay and look at its recording."""

from __future__ import annotations

import argparse
import atexit
import gc
import sys
from importlib import import_module

DESCRIPTION = """\
A shake-table digital twin for rocking blocks.

  twin run                    the main job: block B6L on the emulated Quanser ST-III, one full sine, live at 1 kHz
  twin plan SCENE             what the table can do of a scene and what the block will do; nothing moves
  twin tune SCENE             correct the command of a scene's pulse until the table performs it
  twin map SCENE              which pulses of a grid overturn the block, and which of them the table can run
  twin sensitivity SCENE      what hangs on the model, the first tilt and the slenderness; perturbed starts
  twin replay FILE.mcap       a recorded run through the same live code again; what if; onto an emulator or a bus
  twin compare A.mcap B.mcap  two recordings, or prediction and measurement of one, impact by impact
  twin calibrate FILE         what a block is, from how it rocked freely
  twin view FILE.mcap         a recorded run in Rerun
  twin chart                  speed against accuracy of every method, measured on this machine
"""
EXIT_CODES = "exit codes: 0 done as asked, 1 not (see each command), 2 bad input"
COMMANDS = (
    "scenes",
    "plan",
    "run",
    "tune",
    "devices",
    "samples",
    "replay",
    "compare",
    "calibrate",
    "export",
    "import",
    "map",
    "sensitivity",
    "chart",
    "view",
    "recover",
    "schema",
    "emulate",
)
"""In the order of `--help`; each has a parser in `twin.parsers` and its work in `twin.commands`, of the same name."""
MODULES = {"import": "import_"}
"""Modules of another name than their command, which is a word of Python's."""
INTERRUPTED = 130
"""Exit code of a command ended by Ctrl-C before or after the table moved (128 + SIGINT, as shells have it)."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="twin", description=DESCRIPTION, epilog=EXIT_CODES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True)

    for name in COMMANDS:
        import_module(f"twin.parsers.{MODULES.get(name, name)}").add(commands)
    return top


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit code."""
    options = parser().parse_args(arguments)
    options.arguments = sys.argv[1:] if arguments is None else arguments
    # What a command imports stays to its end: to look through it for garbage took a tenth of the start, and half a
    # second as the process ended.
    gc.disable()
    command = import_module(f"twin.commands.{MODULES.get(options.command, options.command)}")
    gc.enable()
    atexit.unregister(gc.freeze)
    atexit.register(gc.freeze)
    from twin.errors import InputError

    try:
        return command.run(options)
    except InputError as error:
        print(f"twin {options.command}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"twin {options.command}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has gone (twin ... | head): nothing to say to nobody.
        sys.stderr.close()
        return 1


if __name__ == "__main__":
    sys.exit(main())
