"""heyoka's best route to a verdict map: its SIMD batch integrator, terminal events at the base and at pi/2.

A lane starts at uplift; at the base the callback mirrors and damps, at pi/2 it parks the lane on the equilibrium, where
steps are long. The verdict after the pulse is ours, without stepping: the same favour for both.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin import Block
from twin.rocking.verdict import barrier_margins


class HeyokaMap:
    """Compiled once for a block; `verdicts` and `trajectories` run cells in groups of the SIMD width."""

    def __init__(self, block: Block, tolerance: float = 1e-15) -> None:
        import heyoka as hy

        self.block = block
        self.width = int(hy.recommended_simd_size())
        alpha, eta = block.slenderness, block.housner_restitution
        phi, v = hy.make_vars("phi", "v")
        psi = alpha - phi
        force = hy.par[0] * math.tan(alpha) * hy.sin(hy.par[1] * hy.time)
        self.fallen = np.full(self.width, np.nan)
        self.hits = np.zeros(self.width, dtype=np.int64)

        def strike(ta: Any, sense: int, lane: int) -> bool:
            ta.state[0, lane] = 0.0
            ta.state[1, lane] *= -eta
            ta.pars[0, lane] *= -1.0
            self.hits[lane] += 1
            if self.hits[lane] > 60:  # coming to rest: parked, like a fallen one
                self._park(ta, lane)
            return True

        def fall(ta: Any, sense: int, lane: int) -> bool:
            self.fallen[lane] = ta.time[lane]
            self._park(ta, lane)
            return True

        events = [
            hy.t_event_batch(phi, callback=strike, direction=hy.event_direction.negative),
            hy.t_event_batch(phi - 0.5 * math.pi, callback=fall, direction=hy.event_direction.positive),
        ]
        system = [(phi, v), (v, -hy.sin(psi) - force * hy.cos(psi))]
        zeros = np.zeros((2, self.width))
        self.ta = hy.taylor_adaptive_batch(
            [(phi, system[0][1]), (v, system[1][1])],
            zeros,
            t_events=events,
            tol=tolerance,
            pars=np.zeros((2, self.width)),
        )
        self.parked = np.zeros(self.width, dtype=bool)

    def _park(self, ta: Any, lane: int) -> None:
        ta.state[0, lane] = self.block.slenderness
        ta.state[1, lane] = 0.0
        ta.pars[0, lane] = 0.0
        self.parked[lane] = True

    def run(
        self, amplitudes: NDArray[np.float64], frequencies: NDArray[np.float64], *, times: bool
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64], float]:
        """Return the verdicts, overturning times in s (nan without `times`), and the seconds it took."""
        alpha, eta, p = self.block.slenderness, self.block.housner_restitution, self.block.frequency_parameter
        ta, width = self.ta, self.width
        overturned = np.zeros(len(amplitudes), dtype=bool)
        when = np.full(len(amplitudes), np.nan)
        moving = np.nonzero(amplitudes > 1.0)[0]
        begin = time.perf_counter()
        for first in range(0, len(moving), width):
            cells = np.resize(moving[first : first + width], width)
            a, w = amplitudes[cells], frequencies[cells]
            ta.reset_cooldowns()
            ta.set_time(np.arcsin(1.0 / a) / w)
            # Just above the base, for an event on the start would be found at once.
            ta.state[0] = 1e-14
            ta.state[1] = 0.0
            ta.pars[0] = -a
            ta.pars[1] = w
            self.fallen[:] = np.nan
            self.hits[:] = 0
            self.parked[:] = False
            # The force is s a / g with s = -1 at first, as a > 0 where it lifts.
            ta.propagate_until(2.0 * math.pi / w, max_steps=2000)
            pending = np.zeros(width, dtype=bool)
            for lane in range(width):
                if not math.isnan(self.fallen[lane]):
                    overturned[cells[lane]] = True
                    continue
                if self.parked[lane]:
                    continue
                ahead, around = barrier_margins(alpha, eta, alpha - ta.state[0, lane], ta.state[1, lane])
                overturned[cells[lane]] = ahead > 0.0 or around > 0.0
                pending[lane] = overturned[cells[lane]]
            if times and pending.any():
                ta.pars[0] = 0.0
                for lane in np.nonzero(~pending)[0]:
                    self._park(ta, int(lane))
                for _ in range(200):
                    ta.propagate_for(2.0)
                    if self.parked.all():
                        break
            when[cells] = self.fallen / p
        return overturned, when, time.perf_counter() - begin
