"""`twin run CAMPAIGN.toml`: its runs one after another, a stop between; a trip or a fall ends the call."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from twin.campaign import Campaign, Step, load_campaign
from twin.commands.campaign_progress import Entry, Progress, load_progress, now, save_progress, set_aside
from twin.commands.connection import EMULATOR
from twin.commands.inputs import capacity_for
from twin.commands.progress import compiling
from twin.errors import InputError
from twin.plan_report import response_line
from twin.rehearsal import rehearse
from twin.run_report import RunReport
from twin.scene import Scene


@dataclass(frozen=True, slots=True)
class Performed:
    """What `twin run` made of one scene: exit code, report and recording (None of a dry run), and `--json`'s answer."""

    code: int
    report: RunReport | None = None
    path: Path | None = None
    said: dict[str, object] | None = None


Perform = Callable[[argparse.Namespace, Scene, Path | None], Performed]


def run_campaign(options: argparse.Namespace, perform: Perform) -> int:
    """Perform the runs that are not done yet; 0 all done, 1 stopped before the end."""
    _check(options)
    campaign = load_campaign(options.scene)
    folder = options.out or Path("runs") / campaign.name
    if folder.suffix.lower() == ".mcap":
        raise InputError(f"--out {folder}: a campaign is recorded into a folder, one file a run")
    moves = options.device == EMULATOR or options.arm
    if options.restart and moves and (kept := set_aside(folder)) is not None:
        _say(options, f"restart    what was done before is kept in {kept}")
    progress = load_progress(folder, campaign)
    left = campaign.steps[progress.done :]
    _announce(options, campaign, progress, folder)
    ended = "" if left else "all runs are done; --restart begins again"
    reset = options.reset
    for k, step in enumerate(left):
        _introduce(options, campaign, step)
        if k and moves and not _goes_on(options, campaign, step):
            ended = (
                "stopped by the operator" if sys.stdin.isatty() else "stopped: no terminal to confirm the next run at"
            )
            break
        path = folder / f"{step.slug}-{datetime.now(UTC):%Y%m%dT%H%M%S}.mcap"
        # A trip is acknowledged once, for the run that is made next.
        options.reset = reset and k == 0
        if moves:
            progress = progress.begun(step, path)
            save_progress(folder, progress)
        try:
            performed = perform(options, step.scene, path)
        except BaseException:
            # Without a recording nothing has moved: the run was not begun after all.
            if moves and not path.exists():
                save_progress(folder, progress.ended(None))
            raise
        if performed.report is None:
            continue
        entry = _entry(step, performed.report, performed, path)
        progress = progress.ended(entry)
        save_progress(folder, progress)
        if entry.ended != "performed":
            ended = f"run {step.number} of {len(campaign.steps)} {_END[entry.ended]}"
            break
    done = progress.done == len(campaign.steps)
    _summarise(options, campaign, progress, ended if not done or not left else "")
    return 0 if done or not moves else 1


_END = {
    "fell": "overturned the block: set it up again, the next call goes on with the run after it",
    "tripped": "was stopped by a trip: the next call makes it again",
    "not recorded whole": "was not recorded whole: the next call makes it again",
}


def _check(options: argparse.Namespace) -> None:
    """Raise `InputError` where an option belongs to a single scene, or a campaign may not go on by itself."""
    if options.record is not None or options.scale != 1.0:
        raise InputError("--record and --scale belong to a scene; a campaign says itself what shakes")
    if options.gain is not None:
        raise InputError("--gain belongs to a scene; a campaign has its levels")
    if options.yes and options.device != EMULATOR:
        raise InputError(f"--yes is for emulators: before each run of {options.device} its name is typed")


def _announce(options: argparse.Namespace, campaign: Campaign, progress: Progress, folder: Path) -> None:
    title = f": {campaign.title}" if campaign.title else ""
    _say(options, f"campaign   {campaign.name}{title}")
    _say(options, f"runs       {len(campaign.steps)}, {progress.done} of them done; recorded in {folder}")
    if progress.under_way is not None:
        way = progress.under_way
        _say(
            options,
            f"WARNING    run {way.number} was begun at {way.time} and nobody wrote down how it ended: look at the "
            f"table and the block, and at {way.recording}",
        )
    elif progress.entries and progress.entries[-1].ended != "performed":
        last = progress.entries[-1]
        why = f" ({last.tripped})" if last.tripped else ""
        _say(options, f"last       run {last.number}, {last.run} at {last.level_percent:g} %: {last.ended}{why}")


def _introduce(options: argparse.Namespace, campaign: Campaign, step: Step) -> None:
    """Say what the next run is and what it is expected to do, before anyone agrees to it."""
    with compiling(quiet=options.json):
        rehearsal = rehearse(step.scene, capacity_for(step.scene))
    _say(options, f"\nnext       run {step.number} of {len(campaign.steps)}: {step.title}")
    if step.why:
        _say(options, f"why        {step.why}")
    _say(options, f"expected   {response_line(rehearsal.response, rehearsal.block.slenderness)}")


def _goes_on(options: argparse.Namespace, campaign: Campaign, step: Step) -> bool:
    """Return whether the operator wants the next run; a real table's name is asked for by the run itself."""
    if options.yes:
        return True
    if not sys.stdin.isatty():
        return False
    if options.device != EMULATOR:
        return True
    question = f"Go on with run {step.number} of {len(campaign.steps)} ({step.title})? Type yes to go on: "
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _entry(step: Step, report: RunReport, performed: Performed, path: Path) -> Entry:
    fell = report.measured_overturned or (math.isnan(report.measured_peak) and report.predicted_overturned)
    ended = "performed"
    if report.tripped is not None:
        ended = "tripped"
    elif performed.code != 0:
        ended = "not recorded whole"
    elif fell:
        ended = "fell"
    return Entry(
        number=step.number,
        run=step.run,
        level_percent=step.level,
        digest=step.digest,
        time=now(),
        ended=ended,
        predicted=report.predicted_outcome,
        measured=report.measured_outcome,
        predicted_peak_rad=_finite(report.predicted_peak),
        measured_peak_rad=_finite(report.measured_peak),
        tripped=None if report.tripped is None else report.tripped[:2000],
        recording=str(path)[-2000:],
    )


def _summarise(options: argparse.Namespace, campaign: Campaign, progress: Progress, ended: str) -> None:
    if options.json:
        said = {
            "campaign": campaign.name,
            "runs": len(campaign.steps),
            "done": progress.done,
            "ended": ended or None,
            "performed": [entry.model_dump(exclude={"digest"}) for entry in progress.entries],
        }
        print(json.dumps(said, indent=2, allow_nan=False))
        return
    print(f"\nsummary    {progress.done} of {len(campaign.steps)} runs done")
    for entry in progress.entries:
        peak = "" if entry.measured_peak_rad is None else f", peak {entry.measured_peak_rad:.4f} rad"
        print(
            f"run {entry.number:<6} {entry.run} at {entry.level_percent:g} %: {entry.predicted} predicted, "
            f"{entry.measured} measured{peak}; {entry.ended}; {entry.recording}"
        )
    if ended:
        print(f"ended      {ended}")


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _say(options: argparse.Namespace, line: str) -> None:
    print(line, file=sys.stderr if options.json else sys.stdout, flush=True)
