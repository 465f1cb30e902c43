"""One impact of a stack, and a whole history, in MuJoCo at shrinking steps, beside the exact ones.

    python -m tests.benchmarks.stack_mujoco

MuJoCo (`pip install mujoco`) knows nothing of rocking: boxes in a plane, contacts as soft constraints (time constant of
two steps, damping ratio 100), friction high enough not to slide. It is an independent third opinion on what an impact
does, and on the motion for as long as its steps allow.
"""

from __future__ import annotations

import math
import time

import mujoco
import numpy as np

from tests.twin.stack.independent import Body, IndependentStack
from twin.rocking.block import Block
from twin.stack.simulation import simulate_stack
from twin.stack.stack import Stack

BODIES = [Body(0.06, 0.27, 0.06 * 0.27), Body(0.06, 0.27, 0.06 * 0.27)]
G = 9.81
DEPTH = 0.03


def model(bodies: list[Body], step: float) -> mujoco.MjModel:
    solref = f'solref="{2.0 * step} 100" solimp="0.9999 0.9999 1e-6"'
    parts, z = [], 0.0
    for i, body in enumerate(bodies):
        z += 0.5 * body.height
        size = f"{0.5 * body.width} {DEPTH} {0.5 * body.height}"
        parts.append(
            f'<body name="b{i}" pos="0 0 {z}"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
            f'<joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0" mass="{body.mass}" '
            f'diaginertia="1 {body.inertia} 1"/><geom type="box" size="{size}" friction="100 0 0" {solref}/></body>'
        )
        z += 0.5 * body.height
    text = (
        f'<mujoco><option timestep="{step}" gravity="0 0 {-G}" cone="elliptic" impratio="100" tolerance="1e-14" '
        'iterations="200"/><worldbody><geom type="plane" size="5 5 1" friction="100 0 0" '
        f"{solref}/>{''.join(parts)}</worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(text)


def placed(bodies: list[Body], step: float, sides: tuple[int, ...], angles: list[float], rates: list[float]):
    """Return model and data with every contact at its corner."""
    stack = IndependentStack(bodies, G)
    m = model(bodies, step)
    d = mujoco.MjData(m)
    a, w = np.array(angles), np.array(rates)
    v = stack.velocities(sides, a, w)
    # A contact that is open by a rounding takes no part in an impact: each is a little too deep.
    deep = 0.05 * step * body_width(bodies)
    x, z, rest = 0.0, 0.0, 0.0
    for i, (body, s) in enumerate(zip(bodies, sides, strict=True)):
        lower = a[i - 1] if i else 0.0
        c = stack.c[i]
        x += s * c * (math.cos(lower) - math.cos(a[i])) + 0.5 * body.height * math.sin(a[i])
        z += s * c * (math.sin(a[i]) - math.sin(lower)) - deep + 0.5 * body.height * math.cos(a[i])
        rest += 0.5 * body.height
        d.qpos[3 * i : 3 * i + 3] = x, z - rest, a[i]
        d.qvel[3 * i : 3 * i + 3] = v[3 * i : 3 * i + 3]
        x += 0.5 * body.height * math.sin(a[i])
        z += 0.5 * body.height * math.cos(a[i])
        rest += 0.5 * body.height
    return m, d


def body_width(bodies: list[Body]) -> float:
    return bodies[0].width


def landing(step: float) -> np.ndarray:
    """Rates after the upper of two blocks lands at -1 rad/s, taken back to the landing."""
    lead = 3
    angle = lead * step
    m, d = placed(BODIES, step, (0, 1), [0.0, angle], [0.0, -1.0])
    seen = []
    for k in range(200):
        mujoco.mj_step(m, d)
        if k >= lead + 60:
            seen.append((d.time - lead * step, d.qvel[2], d.qvel[5]))
    table = np.array(seen)
    return np.array([np.polynomial.polynomial.polyfit(table[:, 0], table[:, j], 1)[0] for j in (1, 2)])


def history(step: float, duration: float, times: np.ndarray) -> np.ndarray:
    """Rotations of a pair let go from 0.1 rad together, at `times`."""
    m, d = placed(BODIES, step, (1, 0), [0.1, 0.1], [0.0, 0.0])
    rows, k = [], 0
    while d.time < duration - 0.5 * step and k < times.size:
        while k < times.size and d.time >= times[k] - 0.5 * step:
            rows.append((d.qpos[2], d.qpos[5]))
            k += 1
        mujoco.mj_step(m, d)
    rows += [(d.qpos[2], d.qpos[5])] * (times.size - len(rows))
    return np.array(rows)


def main() -> None:
    exact = np.array(IndependentStack(BODIES, G).impacts((0, 1), [0, 1], np.zeros(2), np.array([0.0, -1.0]))[0][1])
    print("upper block of two lands at -1 rad/s: rates of both just after")
    print(f"  projection (exact)       {exact[0]:+.10f} {exact[1]:+.10f}")
    for step in (2e-4, 2e-5, 2e-6, 2e-7):
        made = landing(step)
        print(
            f"  MuJoCo, step {step:.0e} s    {made[0]:+.10f} {made[1]:+.10f}   off by {np.abs(made - exact).max():.1e}"
        )
    stack = Stack([Block(0.06, 0.27), Block(0.06, 0.27)])
    response = simulate_stack(stack, initial_rotation=0.1, duration=0.95)
    times = np.linspace(0.05, 0.9, 18)
    ours = np.asarray(response.rotations(times))
    print("two blocks let go together from 0.1 rad: largest difference of a rotation up to a time, rad")
    print("  step, s    " + "".join(f"{t:9.2f}" for t in times[::3]) + "   took")
    for step in (1e-4, 1e-5, 2e-6):
        begun = time.perf_counter()
        theirs = history(step, 0.91, times)
        worst = np.maximum.accumulate(np.abs(theirs - ours).max(axis=1))
        print(
            f"  {step:.0e}      " + "".join(f"{x:9.1e}" for x in worst[::3]) + f"   {time.perf_counter() - begun:.1f} s"
        )
    print("  our impacts:", ", ".join(f"{hit.time:.4f} s" for hit in response.impacts[:6]))


if __name__ == "__main__":
    main()
