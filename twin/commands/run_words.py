"""What `twin run` says before and after, on the terminal, as data, and in the recording."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from recordings.recorder import RecorderReport
from twin.commands.connection import Connection
from twin.commands.drivers import driver_of
from twin.commands.run_metadata import answer_times, excitation_metadata, notes, seeds
from twin.plan_data import settings_data
from twin.plan_report import clip_lines, response_line, settings_lines
from twin.provenance import processor, versions
from twin.ramp_down import ramp_down_lines, ramp_downs
from twin.rehearsal import Rehearsal
from twin.run_report import RunReport
from twin.scene import Scene


def opening(
    scene: Scene,
    rehearsal: Rehearsal,
    options: argparse.Namespace,
    answers: Mapping[str, str] | None = None,
) -> dict[str, dict[str, str]]:
    """Return the metadata a recording begins with: enough to run it again and to explain itself.

    `answers` are what device and firmware said of themselves, where they were asked.
    """
    capacity = rehearsal.capacity
    clip = {} if rehearsal.clipped is None else {"report": "\n".join(clip_lines(rehearsal.clipped))}
    settings = {} if rehearsal.settings is None else settings_data(rehearsal.settings)
    numbers = capacity.model_dump(mode="json", exclude={"provenance"}, exclude_none=True)
    return {
        "scene": {"name": scene.name, "title": scene.title, "json": scene.model_dump_json()},
        "notes": notes(scene, options.operator, options.note),
        "excitation": excitation_metadata(rehearsal),
        "seeds": seeds(scene),
        "clip": clip,
        **({"settings": {name: str(value) for name, value in settings.items()}} if settings else {}),
        "capacity": {name: str(value) for name, value in numbers.items()},
        "capacity_provenance": capacity.sources,
        "device": {
            "name": scene.table.device,
            "driver": options.device,
            "protocol": driver_of(options),
            "bus": options.bus,
            **(answers or {}),
        },
        "versions": versions(),
        "processor": processor(),
    }


def closing(
    report: RunReport, link: Connection, times: Mapping[str, Sequence[float]] | None = None
) -> dict[str, dict[str, str]]:
    """Return the metadata a recording ends with: the result and the cycle's statistics.

    `times` are more series to count beside lateness and work, s, for example "sync_to_answer".
    """
    timing = {name: str(value) for name, value in report.timing.percentiles().items()}
    return {
        "result": {
            "tripped": report.tripped or "",
            "trips": "; ".join(f"{trip.name} at {trip.time:.3f} s ({trip.action})" for trip in report.trips),
            "predicted": report.predicted_outcome,
            "measured": report.measured_outcome,
            "executed": str(report.executed),
            "missed": str(report.missed),
            "stopping": str(report.stopping),
            "scheduling": report.scheduling,
            "frames": link.frames(),
        },
        "timing": timing,
        **answer_times(
            {
                "lateness": report.timing.starts,
                "work": report.timing.works,
                "twin": report.timing.thoughts,
                "sync_to_answer": [value for value in report.timing.answers if not math.isnan(value)],
                **(times or {}),
            }
        ),
    }


def before(scene: Scene, rehearsal: Rehearsal) -> list[str]:
    """Return what is about to happen, in lines."""
    lines = [f"scene      {scene.name}: {scene.title}"]
    if rehearsal.clipped is not None:
        lines += clip_lines(rehearsal.clipped)
    if rehearsal.settings is not None:
        lines += settings_lines(rehearsal.settings, rehearsal.motion)
    if scene.table.gain != 1.0:
        lines.append(f"gain       {scene.table.gain:g} of the whole pulse, in what is asked above")
    for fault in (part.fault() for part in scene.fault):
        lines.append(f"fault      injected at {fault.at:.3f} s: {fault.name}: {fault.sentence}")
    length = rehearsal.motion.duration + rehearsal.after
    lines.append(f"expected   {response_line(rehearsal.response, rehearsal.block.slenderness)}")
    machine = rehearsal.capacity.machine
    if machine is None:
        lines += ramp_down_lines(ramp_downs(rehearsal.motion, scene, rehearsal.capacity))
    else:
        lines.append(f"stopping   {machine.stopping}")
    lines.append(f"run        {length:.1f} s at {scene.twin.cycle_hz:g} Hz on {scene.table.device}")
    return lines


def after(report: RunReport, written: RecorderReport) -> list[str]:
    """Return what it came to, in lines."""
    t = report.timing.percentiles()
    late = (
        f"{t['lateness_p50_us']:.0f} us (median), {t['lateness_p99_us']:.0f} (99 %), "
        f"{t['lateness_p999_us']:.0f} (99.9 %), {t['lateness_max_us']:.0f} (most)"
    )
    lines = [
        f"outcome    {report.predicted_outcome} predicted, {report.measured_outcome} measured",
        f"peak       {report.predicted_peak:.4f} rad predicted, {report.measured_peak:.4f} rad measured; "
        f"largest difference at one instant {report.largest_difference:.4f} rad",
        f"cycles     {report.executed} executed, {report.missed} missed (overruns)"
        + (f", {report.stopping} on the way down" if report.stopping else ""),
        f"timing     late by {late}; work {t['work_p50_us']:.0f} us (median), {t['work_p99_us']:.0f} (99 %); "
        f"the twin's own {t['twin_p50_us']:.0f} us (median), {t['twin_p99_us']:.0f} (99 %), "
        f"{t['twin_p999_us']:.0f} (99.9 %) of processor time; "
        f"{report.scheduling}",
        *(f"advice     {moment:.3f} s: {words}" for moment, words in report.advice),
        *(f"trip       {trip.time:.3f} s: {trip.name}: {trip.reason}" for trip in report.trips if not trip.stops),
        f"recording  {written.path}" + ("" if written.complete else f" INCOMPLETE: {_incomplete(written)}"),
    ]
    if report.tripped is not None:
        lines.insert(0, f"TRIPPED    {report.tripped}")
    return lines


def _incomplete(written: RecorderReport) -> str:
    return written.failure or f"{written.dropped} dropped, {written.lost} lost, {written.refused} refused"


def as_data(scene: Scene, report: RunReport, written: RecorderReport, rrd: Path | None) -> dict[str, object]:
    """Return what it came to, for `--json`."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "scene": scene.name,
        "tripped": report.tripped,
        "trips": [
            {"name": trip.name, "time_s": trip.time, "action": trip.action, "reason": trip.reason}
            for trip in report.trips
        ],
        "advice": [{"time_s": moment, "advice": words} for moment, words in report.advice],
        "predicted": {"outcome": report.predicted_outcome, "peak_rotation_rad": report.predicted_peak},
        "measured": {"outcome": report.measured_outcome, "peak_rotation_rad": number(report.measured_peak)},
        "largest_difference_rad": number(report.largest_difference),
        "cycles": {
            "executed": report.executed,
            "missed": report.missed,
            "stopping": report.stopping,
            **report.timing.percentiles(),
        },
        "scheduling": report.scheduling,
        "recording": str(written.path),
        "recording_complete": written.complete,
        "rrd": None if rrd is None else str(rrd),
    }
