"""`twin map`: what every pulse of a grid does to the scene's block."""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
import tempfile
from collections.abc import Callable, Generator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from twin.commands.inputs import capacity_for, scene_of
from twin.commands.map_options import export_path, question_of
from twin.errors import InputError
from twin.map.blocks import OUTCOMES, Question, answers
from twin.map.export import NAMES, export
from twin.map.store import MapStore, asked
from twin.rehearsal import brake_of
from twin.scene import Scene


def run(options: argparse.Namespace) -> int:
    """Make the map; 0 done, 1 stopped by Ctrl-C before its end."""
    scene = scene_of(options)
    question = question_of(options, scene)
    with ExitStack() as stack:
        executor = stack.enter_context(_executor(options.executor))
        part = _part(options, stack)
        store = stack.enter_context(MapStore(part, question, resume=options.resume))
        _fill(store, executor, quiet=options.json)
        if not store.complete:
            return _stopped(options, store)
        _write(options, scene, store)
        counts = _counts(store)
    part.unlink(missing_ok=True)
    if options.json:
        print(json.dumps({**asked(question), "cells": counts}, indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(options, scene, question, counts)))
    return 0


def _part(options: argparse.Namespace, stack: ExitStack) -> Path:
    """Return where the unfinished map is kept: beside the file it becomes, or in a folder that goes away."""
    if options.out is not None:
        return export_path(options.out).with_name(options.out.name + ".part")
    if options.resume:
        raise InputError("--resume goes on with an unfinished --out FILE: give it too")
    return Path(stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))) / "map.part"


def _fill(store: MapStore, executor: Executor | None, *, quiet: bool) -> None:
    """Answer the cells that are missing, with a bar on a terminal, until all are there or Ctrl-C."""
    console = Console(stderr=True)
    columns = (
        TextColumn("map"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    cells = store.question.grid.size
    silent = quiet or not console.is_terminal
    with _interruptible() as stopped, Progress(*columns, console=console, disable=silent) as bar:
        task = bar.add_task("map", total=cells, completed=store.cells_done, rate="")
        for answer in answers(store.question, executor, store.missing(), stopped):
            store.put(answer)
            bar.advance(task, len(answer.codes))
            speed = bar.tasks[0].speed
            bar.update(task, rate="" if speed is None else f"{speed:,.0f} cells/s")


@contextmanager
def _interruptible() -> Generator[Callable[[], bool]]:
    """Turn Ctrl-C into an answer to a question, so that no block is broken off in its middle."""
    asked_to_stop = False

    def ask(*_: object) -> None:
        nonlocal asked_to_stop
        asked_to_stop = True

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked_to_stop
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _executor(address: str | None) -> Generator[Executor | None]:
    """Give the executor that `--executor` names: None for the threads of this process."""
    if address is None:
        yield None
        return
    scheme, _, place = address.partition("://")
    if scheme != "dask" or not place:
        raise InputError(f"--executor is {address!r}; it is dask://HOST:PORT, the address of a dask scheduler")
    try:
        distributed = import_module("distributed")
    except ImportError:
        raise InputError("--executor dask needs the extra: pip install 'shake-table-twin[cluster]'") from None
    try:
        client: Any = distributed.Client(f"tcp://{place}", timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--executor {address} cannot be reached: {_first_line(error)}") from None
    with client:
        yield client.get_executor()


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def _stopped(options: argparse.Namespace, store: MapStore) -> int:
    kept = f"--resume goes on from {store.path}" if options.out is not None else "nothing is kept without --out"
    print(f"twin map: stopped after {store.cells_done} of {store.question.grid.size} cells; {kept}", file=sys.stderr)
    return 1


def _write(options: argparse.Namespace, scene: Scene, store: MapStore) -> None:
    if options.out is not None:
        export(store, options.out)
    if options.picture is not None:
        from twin.map.picture import draw_map

        capacity = capacity_for(scene)
        draw_map(
            store,
            options.picture,
            capacity,
            title=scene.title,
            brake=brake_of(scene, capacity),
            coast=scene.table.coast_s,
            payload=scene.block.mass_kg,
        )


def _counts(store: MapStore) -> dict[str, int]:
    total = np.zeros(len(OUTCOMES), dtype=np.int64)
    for codes in store.chunks("outcome"):
        total += np.bincount(np.asarray(codes, dtype=np.uint8), minlength=len(OUTCOMES))
    return dict(zip(NAMES, total.tolist(), strict=True))


def _lines(options: argparse.Namespace, scene: Scene, question: Question, counts: dict[str, int]) -> list[str]:
    grid = question.grid
    shown = ", ".join(f"{count} {name}" for name, count in counts.items() if count or name in NAMES[:4])
    how = question.model or "nonlinear"
    tilt = f", tilted by {math.degrees(question.initial_rotation):g} deg" if question.initial_rotation else ""
    lines = [
        f"scene      {scene.name}: {scene.title}",
        f"map        {grid.kind}, {grid.shape[0]} x {grid.shape[1]} cells, {how}{tilt}",
        f"outcomes   {shown}",
    ]
    if options.out is not None:
        lines.append(f"written    {options.out}")
    if options.picture is not None:
        lines.append(f"picture    {options.picture}")
    return lines
