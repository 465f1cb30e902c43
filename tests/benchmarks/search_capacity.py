"""Proposals of random searches, counted and judged: devices, shares of their capacities, goals and seeds at random.

    python -m tests.benchmarks.search_capacity --count 100

Each proposal goes through the clip afresh and through the device's own check of every set-point (or setting).
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from devices.catalogue import find_device
from tests.twin.search.test_find import SCENES, check_inside
from twin.errors import InputError
from twin.scene import load_scene
from twin.search.find import Effort, find_runs
from twin.search.goals import Aim, Goal

EFFORT = Effort(sizes=28, shapes=8, futures=200)


def main() -> int:
    """Search and count; 1 where a proposal exceeds its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    searches, proposals, refused, bad = (Counter[str]() for _ in range(4))
    for _ in range(options.count):
        device = str(rng.choice(sorted(SCENES)))
        name = str(rng.choice(SCENES[device]))
        own = find_device(device).capacity
        shares = np.exp(rng.uniform(np.log(0.15), np.log(2.0), 3))
        update: dict[str, object] = {
            key: getattr(own, key) * float(share)
            for key, share in zip(("stroke", "velocity", "acceleration"), shares, strict=True)
        }
        if device == "quanser_st3" and rng.random() < 0.5:
            update |= {"frequency": float(rng.uniform(1.0, 20.0)), "jerk": float(rng.uniform(50.0, 1e4))}
        capacity = own.model_copy(update=update)
        aim = Aim(str(rng.choice([aim.value for aim in Aim])))
        searches[device] += 1
        try:
            seed = int(rng.integers(2**31))
            search = find_runs(load_scene(name), capacity, Goal(aim), seed=seed, restitution=0.9, effort=EFFORT)
        except InputError:
            refused[device] += 1
            continue
        for proposal in search.proposals:
            proposals[device] += 1
            try:
                check_inside(proposal, capacity)
            except AssertionError as error:
                bad[device] += 1
                print(device, capacity, proposal.words, error)
    for device in sorted(SCENES):
        print(
            f"{device:12} {searches[device]} searches, {refused[device]} with no pulse at all, "
            f"{proposals[device]} proposals, {bad[device]} beyond the capacity"
        )
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
