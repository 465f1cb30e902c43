"""Maps beside their peers: `python tests/benchmarks/run_maps.py [--cells N] [--quick]`.

B6L of N. Ceh's thesis, one sine, A and W from 0.1 to 10, verdicts and overturning times; medians of several runs, the
compilers' and start-up time apart. What is not installed is left out (extra `peers`). Every figure stands beside its
accuracy: wrong cells against the accurate method, error of the overturning time.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from twin import Block, overturning_map, simulate  # noqa: E402

B6L = Block(0.06, 0.27, mass=2.5692)
Row = tuple[str, str, str]


def main() -> None:
    """Run what is asked and print one table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=160_000, help="cells of the verdict map (default: 160000)")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="leave out 1e7 cells and the start-up times")
    options = parser.parse_args()
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    print(f"{os.cpu_count()} processors, load {load} before the start\n")
    rows = [*ours(options), *peers(options), *scaling(options)]
    if not options.quick:
        rows += start_up()
    width = max(len(row[0]) for row in rows)
    for name, speed, accuracy in rows:
        print(f"{name:<{width}}  {speed:>26}  {accuracy}")


def axis(cells: int) -> np.ndarray:
    """Return the values of a square map's axes."""
    return np.linspace(0.1, 10.0, round(cells**0.5))


def timed(work: Callable[[], object], repeats: int) -> float:
    """Return the median time of `work`, s, after one run that does not count."""
    work()
    spent: list[float] = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        spent.append(time.perf_counter() - begin)
    return statistics.median(spent)


def ours(options: argparse.Namespace) -> list[Row]:
    """Measure verdicts, times and the lasting sine."""
    x, small = axis(options.cells), axis(10_000)
    exact = overturning_map(B6L, amplitudes=small, frequencies=small, times=True, peaks=True)
    chart = overturning_map(B6L, amplitudes=small, frequencies=small, times=True)
    late = np.abs(chart.overturning_time - exact.overturning_time)[chart.overturned]
    found = f"{int(chart.overturned.sum())} of 10000 overturn, {int(np.sum(chart.codes == 3))} undecided, "
    wrong = f"{int(np.sum(chart.codes != exact.codes))} wrong"
    verdicts = timed(lambda: overturning_map(B6L, amplitudes=x, frequencies=x), options.repeats)
    process = time.process_time()
    overturning_map(B6L, amplitudes=x, frequencies=x)
    process = time.process_time() - process
    times = timed(lambda: overturning_map(B6L, amplitudes=x, frequencies=x, times=True), options.repeats)
    long = timed(lambda: overturning_map(B6L, "lasting sine", amplitudes=small, frequencies=small, duration=10.0), 1)
    lasting = overturning_map(B6L, "lasting sine", amplitudes=small, frequencies=small, duration=10.0)
    return [
        ("twin verdicts, all processors", rate(len(x) ** 2, verdicts), found + wrong),
        ("twin verdicts, per processor-second", rate(len(x) ** 2, process), "not slowed by what else the machine does"),
        (
            "twin overturning times, all processors",
            rate(len(x) ** 2, times),
            f"time off by {late.max():.1e} s at most, {np.median(late):.1e} s median",
        ),
        ("twin lasting sine, 10 s", rate(10_000, long), f"{100 * np.mean(lasting.codes == 3):.2f} % undecided"),
    ]


def rate(cells: int, seconds: float) -> str:
    """Return cells per second in words."""
    return f"{cells / seconds:,.0f} cells/s"


def peers(options: argparse.Namespace) -> list[Row]:
    """Measure heyoka, the thesis' Newmark in Numba and SciPy on the same map."""
    x = axis(10_000)
    a, w = (values.ravel() for values in np.meshgrid(x, x, indexing="ij"))
    exact = overturning_map(B6L, amplitudes=x, frequencies=x, times=True)
    truth = exact.overturned.ravel()
    return [*_heyoka(options, exact, a, w), *_newmark(options, truth, a, w), _scipy(truth, a, w)]


def _heyoka(options: argparse.Namespace, exact: object, a: np.ndarray, w: np.ndarray) -> list[Row]:
    try:
        from tests.benchmarks.map_heyoka import HeyokaMap

        integrator = HeyokaMap(B6L)
    except ImportError:
        return [("heyoka", "not installed", "pip install 'shake-table-twin[peers]'")]
    rows: list[Row] = []
    for times, name in ((False, "heyoka verdicts, one process"), (True, "heyoka overturning times, one process")):
        runs = [integrator.run(a, w, times=times) for _ in range(options.repeats)]
        spent = statistics.median(run[2] for run in runs)
        wrong = f"{int(np.sum(runs[0][0] != exact.overturned.ravel()))} wrong"
        if times:
            late = np.abs(runs[0][1] - exact.overturning_time.ravel())[exact.overturned.ravel()]
            wrong += f", time off by {np.nanmax(late):.1e} s at most"
        rows.append((name, rate(len(a), spent), wrong))
    with concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(heyoka_share, [1] * (os.cpu_count() or 1)))
        begin = time.time()
        ends = list(pool.map(heyoka_share, [10] * (os.cpu_count() or 1)))
        cells = sum(end[0] for end in ends)
        rows.append(("heyoka verdicts, a process per processor", rate(cells, max(end[1] for end in ends) - begin), ""))
    return rows


_KEPT: list[object] = []


def heyoka_share(times: int) -> tuple[int, float]:
    """Run the 100 x 100 map `times` times in this process; return the number of cells and when it was done."""
    from tests.benchmarks.map_heyoka import HeyokaMap

    if not _KEPT:
        _KEPT.append(HeyokaMap(B6L))
    x = axis(10_000)
    a, w = (values.ravel() for values in np.meshgrid(x, x, indexing="ij"))
    for _ in range(times):
        _KEPT[0].run(a, w, times=False)
    return times * len(a), time.time()


def _newmark(options: argparse.Namespace, truth: np.ndarray, a: np.ndarray, w: np.ndarray) -> list[Row]:
    from tests.benchmarks.map_newmark import newmark_map

    def work(cells: slice = slice(None)) -> np.ndarray:
        alpha, p, eta = B6L.slenderness, B6L.frequency_parameter, B6L.housner_restitution
        return newmark_map(alpha, p, eta, a[cells], w[cells], 1e-3)

    def shared() -> None:
        n = os.cpu_count() or 1
        with concurrent.futures.ThreadPoolExecutor(n) as pool:
            list(pool.map(work, [slice(k, None, n) for k in range(n)]))

    wrong = int(np.sum((work() > 0.0) != truth))
    note = f"{wrong} wrong (verdict after the pulse by our rule, without stepping on)"
    return [("Newmark 1 ms in Numba, all processors", rate(len(a), timed(shared, options.repeats)), note)]


def _scipy(truth: np.ndarray, a: np.ndarray, w: np.ndarray) -> Row:
    from excitation import SineWave

    picked = np.random.default_rng(0).choice(len(a), 30, replace=False)
    begin = time.perf_counter()
    wrong = 0
    for cell in picked:
        pulse = SineWave(a[cell] * B6L.uplift_acceleration, w[cell] * B6L.frequency_parameter / (2.0 * np.pi))
        response = simulate(B6L, pulse, method="dop853")
        wrong += (response.outcome.value == "overturned") != truth[cell]
    spent = time.perf_counter() - begin
    return ("SciPy DOP853 (simulate), one processor", rate(len(picked), spent), f"{wrong} of {len(picked)} wrong")


def scaling(options: argparse.Namespace) -> list[Row]:
    """Measure cost and memory from 1e4 to 1e7 cells, streamed to disk as the command does."""
    from twin.map.blocks import Question, answers
    from twin.map.grid import make_grid
    from twin.map.store import MapStore

    rows: list[Row] = []
    for cells in (10**4, 10**5, 10**6, *(() if options.quick else (10**7,))):
        x = axis(cells)
        asked = Question(make_grid(B6L, "sine", amplitudes=x, frequencies=x))
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            with MapStore(Path(folder) / "map.part", asked) as store:
                for answer in answers(asked, None, store.missing()):
                    store.put(answer)
            spent = time.perf_counter() - begin
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        note = f"{1e6 * spent / asked.grid.size:.2f} us a cell, most memory so far {peak:.0f} MiB"
        rows.append((f"twin to disk, {asked.grid.size:.0e} cells", rate(asked.grid.size, spent), note))
    return rows


def start_up() -> list[Row]:
    """Measure a fresh process that makes a small map, with an empty compile cache and with a full one."""
    code = (
        "from twin import Block, overturning_map;"
        "print(overturning_map(Block(0.06, 0.27), amplitudes=[1.5, 3.0], frequencies=[2.0, 5.0]).overturned.sum())"
    )
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder, "PYTHONPATH": str(ROOT)}
        for name in ("first use, compiling", "later use, from the cache"):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True)
            rows.append((f"twin map, {name}", f"{time.perf_counter() - begin:.2f} s", "process start to answer"))
    return rows


if __name__ == "__main__":
    main()
