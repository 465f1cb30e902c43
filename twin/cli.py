"""The command `twin`: plan a run, perform it, replay and look at its recording."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pathlib import Path

DESCRIPTION = """\
A shake-table digital twin for rocking blocks.

  twin run                    the main job: block B6L on the emulated Quanser ST-III, one full sine, live at 1 kHz
  twin plan SCENE             what the table can do of a scene and what the block will do; nothing moves
  twin map SCENE              which pulses of a grid overturn the block, and which of them the table can run
  twin replay FILE.mcap       a recorded run through the same live code again
  twin view FILE.mcap         a recorded run in Rerun
  twin chart                  speed against accuracy of every method, measured on this machine
"""
EXIT_CODES = "exit codes: 0 done as asked, 1 not (see each command), 2 bad input"
DEFAULT_SCENE = "b6l_sine"
INTERRUPTED = 130
"""Exit code of a command ended by Ctrl-C before or after the table moved (128 + SIGINT, as shells have it)."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="twin", description=DESCRIPTION, epilog=EXIT_CODES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True)

    scenes = _command(commands, "scenes", "list the scenes that ship with the package", "exit codes: 0")
    scenes.add_argument("name", nargs="?", metavar="SCENE", help="print this scene's TOML, a start for one of your own")

    plan = _command(
        commands,
        "plan",
        "clip a scene to its table, predict the block, and say how far from overturning it is; nothing moves",
        "exit codes: 0 the table can do it as asked and the block stays up, 1 it cannot, or clipping changed the "
        "pulse, or the block falls, 2 bad input",
    )
    _scene(plan)
    plan.add_argument("--out", type=Path, metavar="PLAN.png", help="draw the plan (.png, .svg or .pdf)")

    run = _command(
        commands,
        "run",
        "perform a scene live, prediction beside measurement, and record it",
        "exit codes: 0 performed and recorded, 1 tripped (the table was stopped) or not recorded whole, 2 bad input",
    )
    _scene(run)
    run.add_argument(
        "--device",
        default="emulator",
        metavar="NAME",
        help="emulator (default: nothing real moves), or the name of a real table, which asks for confirmation first",
    )
    _bus(run)
    run.add_argument(
        "--reset", action="store_true", help="acknowledge a fault the drive is still in, after its cause is gone"
    )
    run.add_argument("--out", type=Path, metavar="FILE.mcap", help="where to record (default: ./runs/SCENE-TIME.mcap)")
    run.add_argument("--view", action="store_true", help="open a Rerun viewer (on 127.0.0.1) and follow the run in it")
    run.add_argument("--no-rrd", action="store_true", help="write no .rrd beside the recording")

    emulate = _command(
        commands,
        "emulate",
        "be the emulated table and specimen of a scene, in a process of its own, until Ctrl-C",
        "exit codes: 0 stopped by Ctrl-C, 2 bad input",
    )
    _scene(emulate)
    _bus(emulate, "udp_multicast")

    replay = _command(
        commands,
        "replay",
        "feed a recorded base motion to the same live code and compare the predictions",
        "exit codes: 0 the predictions agree, 1 they do not, 2 bad input",
    )
    replay.add_argument("file", type=Path, metavar="FILE.mcap")
    replay.add_argument(
        "--speed", type=float, metavar="X", help="1 is real time, 0.1 a tenth of it (default: as fast as it goes)"
    )

    chart = _command(
        commands,
        "chart",
        "measure speed against accuracy of every method on this machine, and draw it",
        "exit codes: 0 measured, 1 the default method was wrong or refused somewhere, or Ctrl-C, 2 bad input",
    )
    chart.add_argument(
        "--out",
        type=Path,
        default=Path("chart.png"),
        metavar="CHART.png",
        help="the picture (.png, .svg or .pdf; default: chart.png); a .csv of every point is written beside it",
    )
    chart.add_argument("--record", type=Path, metavar="FILE.at2", help="an earthquake record too (PEER AT2 or CSV)")
    chart.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="factor on the record's acceleration (default: 1)"
    )
    chart.add_argument("--quick", action="store_true", help="fewer points and a coarser map: under 30 s")

    _map(commands)

    view = _command(commands, "view", "open a recording in Rerun", "exit codes: 0 shown or written, 2 bad input")
    view.add_argument("file", type=Path, metavar="FILE.mcap")
    view.add_argument("--out", type=Path, metavar="FILE.rrd", help="write a Rerun file instead of opening a viewer")
    return top


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit code."""
    options = parser().parse_args(arguments)
    command = import_module(f"twin.commands.{options.command}")
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


def _command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],  # pyright: ignore[reportPrivateUsage]
    name: str,
    purpose: str,
    codes: str,
) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=purpose, description=purpose[0].upper() + purpose[1:] + ".", epilog=codes)
    command.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    return command


def _scene(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "scene",
        nargs="?",
        default=DEFAULT_SCENE,
        metavar="SCENE",
        help=f"name of a shipped scene (see `twin scenes`) or path of a .toml file (default: {DEFAULT_SCENE})",
    )
    command.add_argument(
        "--record", type=Path, metavar="FILE.at2", help="shake with this earthquake record (PEER AT2 or CSV) instead"
    )
    command.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="factor on the record's acceleration (default: 1)"
    )


def _map(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:  # pyright: ignore[reportPrivateUsage]
    command = _command(
        commands,
        "map",
        "find what every pulse of a grid does to a scene's block",
        "exit codes: 0 the map is done, 1 stopped by Ctrl-C (with --out, --resume goes on), 2 bad input",
    )
    _scene(command)
    command.add_argument(
        "--kind",
        metavar="KIND",
        help="sine, cosine, lasting-sine (with --duration), constant or double-pulse (default: the scene's)",
    )
    spans = (
        ("amplitude", "rows of waves and constant pulses, in g tan(alpha), or with the unit g or m/s2"),
        ("frequency", "columns of waves, omega in p, or with the unit Hz or rad/s"),
        ("length", "columns of constant pulses, p times the time, or with the unit s or ms"),
        ("velocity", "rows of double pulses: peak velocity in m/s, or with the unit mm/s"),
        ("gap", "columns of double pulses: stop gap in m, or with the unit mm"),
    )
    for name, purpose in spans:
        command.add_argument(f"--{name}", metavar="START:STOP:COUNT", help=f"{purpose}, as in 0.1:10:100")
    command.add_argument("--duration", type=float, metavar="S", help="length of a lasting sine, s")
    command.add_argument("--full", action="store_true", help="overturning times and peak rotations too")
    command.add_argument("--method", metavar="NAME", help="cell by cell with this method of `simulate`: slow")
    command.add_argument("--model", metavar="NAME", help="nonlinear (default), quasi-linear, linearised or auto: slow")
    command.add_argument("--restitution", metavar="ETA", help="a number, improved:K or housner (default: the scene's)")
    command.add_argument("--initial-tilt", type=float, metavar="DEG", help="initial rotation (default: the scene's)")
    command.add_argument("--executor", metavar="dask://HOST:PORT", help="work on this dask cluster (extra `cluster`)")
    command.add_argument("--out", type=Path, metavar="FILE.npz", help="write the map (.npz or .csv)")
    command.add_argument("--picture", type=Path, metavar="FILE.png", help="draw it, with what the table can run")
    command.add_argument("--resume", action="store_true", help="go on with an --out that was stopped")


def _bus(command: argparse.ArgumentParser, default: str = "virtual") -> None:
    command.add_argument(
        "--bus",
        default=default,
        metavar="INTERFACE",
        help="python-can interface: virtual (inside this process), udp_multicast (`twin emulate` is the other one, on "
        f"this machine), socketcan and others for real tables (default: {default})",
    )
    command.add_argument("--channel", metavar="NAME", help="the interface's channel, e.g. can0")
    command.add_argument(
        "--bus-option",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="passed on to python-can untouched, may be given again, e.g. bitrate=1000000, or port=43200 for a second "
        "udp_multicast run on one machine",
    )


if __name__ == "__main__":
    sys.exit(main())
