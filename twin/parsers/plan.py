"""The parser of `twin plan`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "plan",
        "clip a scene to its table, predict the block, and say how far from overturning it is; or find the run for a "
        "goal; or plan a campaign; nothing moves",
        "exit codes: 0 the table can do it as asked and the block stays up (--find: there is a run to propose), 1 it "
        "cannot, or clipping changed the pulse, or the block falls (--find: there is none), 2 bad input",
    )
    arguments.scene(parser)
    arguments.tuned(parser)
    parser.add_argument(
        "--out", type=Path, metavar="PLAN.pdf", help="the plan on a page to be signed (.pdf, .png, .svg or .html)"
    )
    finding = parser.add_argument_group("finding runs")
    finding.add_argument(
        "--find",
        metavar="GOAL",
        help='propose runs inside the table\'s capacity: "overturn without impact", "overturn", "largest safe '
        'amplitude" (at the scene\'s frequency, or "... at 3 Hz"; probability below 1 %%, or "... below 5 %%"), "rock '
        'without overturning", "separate restitution"',
    )
    finding.add_argument(
        "--restitution",
        type=float,
        metavar="ETA",
        help="the measured one, to tell from Housner's (default: the scene's)",
    )
    finding.add_argument("--proposals", type=int, default=5, metavar="N", help="how many runs at most (default: 5)")
    finding.add_argument("--seed", type=int, default=1, metavar="N", help="of the futures drawn (default: 1)")
    finding.add_argument(
        "--campaign", type=Path, metavar="OUT.toml", help="write the proposed runs as a campaign for `twin run`"
    )
    finding.add_argument(
        "--levels", metavar="10,25,50,100", help="staged levels of that campaign, percent of the whole pulse"
    )
