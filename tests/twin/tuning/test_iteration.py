"""The iteration against tables it does not know: it converges, or stops and says why."""

from __future__ import annotations

import numpy as np
import pytest

from devices.errors import DriveStopped
from excitation import Capacity, ConstantPulse, CosineWave, Pulse, Record, SineWave
from tests.twin.tuning.plants import BENCH, SINE, H, Setting, Table, Weak, inside, true_error
from twin.tuning.iteration import GAIN, Tuning, tune
from twin.tuning.report import sentences
from twin.tuning.window import Trace

ROOM = BENCH.model_copy(update={"stroke": 4.0, "velocity": 2.0})
"""For records, which end somewhere else."""


def tuned(pulse: Pulse, table: Table, capacity: Capacity = BENCH, **options) -> tuple[Tuning, Setting]:
    setting = Setting.of(pulse)
    return tune(setting.window, setting.command, table, inside(capacity), **options), setting


def quake(seed: int = 3) -> Record:
    """A record of 4 s whose acceleration is a coloured noise that comes and goes, on a grid of 10 ms."""
    rng = np.random.default_rng(seed)
    samples = np.convolve(rng.standard_normal(440), np.hanning(14), "same")[20:421] * np.hanning(401)
    return Record(2.0 * samples / np.max(np.abs(samples)), 0.01)


@pytest.mark.parametrize(
    "table",
    [
        Table(),
        Table(delay=15),
        Table(frequency=12.0),
        Table(damping=0.15),
        Table(frequency=45.0, damping=1.5, delay=4),
        Table(gain=lambda: 0.85),
    ],
    ids=["lag", "delay", "slow", "lightly damped", "sluggish", "gain"],
)
def test_a_single_sine_is_reproduced_by_any_linear_table(table: Table) -> None:
    tuning, setting = tuned(SINE, table)
    assert tuning.reason == "converged: the error no longer falls"
    assert tuning.improved
    rms, largest = true_error(table, setting.window)
    assert tuning.before.rms > 0.04
    assert rms < 0.012
    assert largest < 0.06
    # What is said of it is what is true, but for noise.
    assert tuning.verified is not None
    assert tuning.verified.rms == pytest.approx(np.hypot(rms, tuning.verified.noise), abs=2e-3)


def test_noise_bounds_what_can_be_reached_and_is_not_chased() -> None:
    reached = {}
    for noise in (0.0, 0.049, 0.3):
        table = Table(noise=noise, encoder=0.0 if noise == 0.0 else 1.55e-6)
        tuning, setting = tuned(SINE, table)
        assert tuning.improved
        reached[noise] = true_error(table, setting.window)[0]
        # Nothing is won by more: twice as many corrections leave as much.
        longer, _ = tuned(SINE, Table(noise=noise, encoder=table.encoder), most=20)
        assert len(longer.steps) == len(tuning.steps) <= 9
    assert reached[0.0] < 0.002 < reached[0.049] < 0.008 < reached[0.3] < 0.03


def test_a_cosine_jumps_and_that_remains() -> None:
    table = Table()
    tuning, setting = tuned(CosineWave(2.943, 4.0), table)
    rms, largest = true_error(table, setting.window)
    assert tuning.improved
    assert tuning.before.rms > 0.2
    assert tuning.before.peak == pytest.approx(1.0, abs=0.05)
    assert rms < 0.07
    # Half of a jump is missed by whatever is continuous: on one side of it or on the other.
    assert 0.4 < largest < 0.6
    told = next(line for line in sentences(tuning, setting.window) if line.startswith("remains"))
    assert "jumps by 100% of its peak" in told
    # Away from the jumps it is as good as a sine.
    away = np.abs((setting.window.acceleration - setting.window.cut(table.truth[-1])) / setting.window.peak)
    t = setting.window.start + np.arange(setting.window.size) * H
    assert np.max(away[(t > 0.03) & (t < 0.22)]) < 0.03


def test_a_constant_pulse_with_its_brake() -> None:
    table = Table()
    tuning, setting = tuned(ConstantPulse(2.0, 0.15), table)
    assert tuning.improved
    assert true_error(table, setting.window)[0] < 0.4 * tuning.before.rms


def test_a_record() -> None:
    table = Table(delay=5)
    tuning, setting = tuned(quake(), table, ROOM)
    assert tuning.improved
    assert tuning.before.rms > 0.08
    assert true_error(table, setting.window)[0] < 0.01


@pytest.mark.parametrize("pulse", [SINE, CosineWave(2.943, 4.0), quake()], ids=["sine", "cosine", "record"])
def test_the_command_is_changed_about_the_pulse_alone(pulse: Pulse) -> None:
    table = Table()
    tuning, setting = tuned(pulse, table, ROOM, most=3)
    change = table.played[-1] - setting.command
    window = setting.window
    assert np.all(change[: window.first] == 0.0)
    assert np.all(change[window.first + window.size :] == 0.0)
    # At rest at both ends, and no drift left behind: there is no change, and it does not begin with a kick.
    assert tuning.correction[0] == tuning.correction[-1] == 0.0
    for end in (tuning.correction[:3], tuning.correction[-3:]):
        assert np.max(np.abs(end)) < 1e-7
        assert np.max(np.abs(np.diff(end, 2))) / H**2 < 0.05
    assert np.max(np.abs(change)) < 0.01


@pytest.mark.parametrize("share", [1.0, 1.02, 1.2])
def test_no_command_beyond_the_capacity_is_played(share: float) -> None:
    capacity = BENCH.model_copy(update={"acceleration": share * 2.943, "name": "tiny"})
    table = Table(frequency=12.0)
    tuning, _ = tuned(SINE, table, capacity)
    assert all(inside(capacity)(command) is None for command in table.played)
    assert tuning.improved
    assert tuning.verified is not None
    if share < 1.2:
        assert tuning.reason.startswith("no room inside the capacity for a further correction: set-point of cycle")
        limited = next(step for step in tuning.steps if step.limited)
        assert limited.gain < GAIN
        assert f"tiny has {capacity.acceleration:.6g} m/s2" in limited.limited


def test_a_table_too_weak_for_its_gain_has_no_room() -> None:
    """It does 0.9 of what it is told, and the pulse already uses all the velocity there is."""
    capacity = BENCH.model_copy(update={"velocity": SINE.peak_velocity})
    table = Table(frequency=400.0, damping=1.0, delay=0, gain=lambda: 0.9)
    tuning, setting = tuned(SINE, table, capacity)
    assert tuning.reason.startswith("no room inside the capacity")
    assert "m/s" in tuning.reason
    assert not tuning.improved
    assert len(tuning.steps) <= 2
    assert np.max(np.abs(table.played[-1] - setting.command)) < 1e-3


def test_a_saturating_table_ends_with_its_best() -> None:
    table = Weak()
    tuning, _ = tuned(SINE, table)
    assert tuning.reason == "converged: the error no longer falls"
    assert tuning.verified is not None
    assert tuning.improved
    # It cannot: what remains is far above the noise, and is said.
    assert tuning.verified.rms > 0.1
    # The correction that is kept is the best of those tried, though later ones were worse.
    assert tuning.verified.rms == pytest.approx(min(step.reproduction.rms for step in tuning.steps), rel=0.05)


@pytest.mark.parametrize("seed", range(6))
def test_a_table_that_does_not_repeat_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = Table(gain=lambda: 1.0 + 0.3 * rng.standard_normal())
    tuning, _ = tuned(SINE, table)
    assert tuning.reason.startswith("nothing to correct: equal runs differ by")
    assert not tuning.improved
    assert not tuning.correction.any()


def test_a_table_that_needs_no_correction() -> None:
    setting = Setting.of(SINE)
    rng = np.random.default_rng(2)
    asked = setting.motion.acceleration(np.arange(setting.command.size) * H)

    def perfect(command: np.ndarray) -> Trace:
        return Trace(command, asked + 0.2 * rng.standard_normal(asked.size))

    tuning = tune(setting.window, setting.command, perfect, inside(BENCH))
    assert tuning.reason.startswith("nothing to correct")
    assert not tuning.improved
    assert not tuning.correction.any()


def test_where_the_error_rises_the_gain_is_halved_and_then_it_stops() -> None:
    """A table that answers every command but the first backwards: no transfer function describes it."""
    setting = Setting.of(SINE)
    base = Table()

    def contrary(command: np.ndarray):
        return base(2.0 * setting.command - command)

    tuning = tune(setting.window, setting.command, contrary, inside(BENCH))
    gains = [step.gain for step in tuning.steps[1:]]
    assert gains[:3] == pytest.approx([GAIN, GAIN / 2, GAIN / 4])
    assert tuning.reason == "no correction lowers the error"
    assert not tuning.improved
    assert not tuning.correction.any()


def test_too_few_corrections_are_said() -> None:
    tuning, _ = tuned(SINE, Table(), most=1)
    assert tuning.reason == "the error was still falling after 1 corrections"
    assert tuning.improved


def test_what_a_run_raises_ends_it() -> None:
    table = Table()

    def play(command: np.ndarray):
        if len(table.played) == 5:
            raise DriveStopped("operator")
        return table(command)

    setting = Setting.of(SINE)
    with pytest.raises(DriveStopped):
        tune(setting.window, setting.command, play, inside(BENCH))


def test_steps_are_told_as_they_come() -> None:
    told = []
    tuning, _ = tuned(SineWave(1.0, 5.0), Table(), most=2, told=lambda number, step: told.append((number, step)))
    assert [number for number, _ in told] == list(range(len(tuning.steps)))
    assert [step for _, step in told] == tuning.steps
