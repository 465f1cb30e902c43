"""A calibration as a person reads it, as JSON, and as the lines a scene would take."""

from __future__ import annotations

import math

import numpy as np

from twin.calibration.calibrate import (
    FREQUENCY,
    HEIGHT,
    RESTITUTION,
    SLENDERNESS,
    STIFFNESS,
    TILT,
    WIDTH,
    ZERO,
    Calibration,
    K,
)
from twin.calibration.contact import Contact
from twin.calibration.entry import HELD
from twin.calibration.estimate import Estimate

LOOSE = 0.03
"""A slenderness less certain than this, relative, is said to be so."""
SURE = 3.0
"""Deviations from which on a trend is worth a line."""
CORRELATED = 0.5
"""A correlation of which a scene's reader should know: its futures draw them apart."""
SHOWN = 12
"""Impacts shown one by one."""


def lines(found: Calibration, contact: Contact | None = None, *, full: bool = False) -> list[str]:
    """Return what to print, heads of 11 characters; `full`: every impact."""
    estimates = found.estimates
    result = [
        _fitted(found),
        f"eta        {_told(estimates[RESTITUTION], 4)}; {_scatter(found)}",
        f"Housner    {_told(found.housner, 4)} of the slenderness found: {_against(found)}",
        f"improved   k = {_told(estimates[K], 3)}{_outside(estimates[K])}",
        f"slender    alpha = {_told(estimates[SLENDERNESS], 5)} rad{_nominal(found, SLENDERNESS)}",
        f"frequency  p = {_told(estimates[FREQUENCY], 4)} rad/s{_nominal(found, FREQUENCY)}",
        f"size       {_size(found)}",
        *_weak(found),
        f"tilt       {_tilt(found)}",
    ]
    trend, error = found.overall.trend, found.overall.trend_error
    if math.isfinite(trend) and abs(trend) > SURE * error:
        result.append(
            f"trend      restitution changes by {100.0 * trend:+.2f} % (standard deviation {100.0 * error:.2f}) where "
            "the rate before the impact is e times larger"
        )
    if contact is not None:
        result += contact_lines(contact)
    result += _impacts(found, full=full)
    result += [f"note       {words}" for words in found.fit.repairs]
    kinds = list(dict.fromkeys(suspicion.kind for suspicion in found.suspicions))
    result += [f"suspicion  {suspicion.kind}: {suspicion.sentence}" for suspicion in found.suspicions]
    verdict = (
        f"not pure rocking ({', '.join(kinds)}): take the numbers with care" if kinds else "rocks as a rigid block"
    )
    return [*result, f"verdict    {verdict}"]


def contact_lines(contact: Contact) -> list[str]:
    """Return the lines that compare edge and full contact."""
    edge = contact.edge.estimates[RESTITUTION]
    return [
        f"edge       eta = {_told(edge, 4)} on its edges, Housner {contact.edge.housner.value:.4f}",
        f"material   {_told(contact.material, 4)} of every rate is left by the material (edge contact over Housner)",
        f"base       {_told(contact.shape, 4)} by the shape of the base: k = {_told(contact.k, 3)} of it alone",
    ]


def data(found: Calibration, contact: Contact | None = None) -> dict[str, object]:
    """Return the calibration for JSON, in SI units and rad."""
    fit, ratio = found.fit, found.restitution
    result: dict[str, object] = {
        "samples": int(fit.flights.time.size),
        "noise_rad": fit.white,
        "residual_rms_rad": fit.noise,
        "variance_inflation": fit.inflation,
        "first_flight": fit.how,
        "estimates": {name.replace(" ", "_"): value.as_data() for name, value in found.estimates.items()},
        "housner": found.housner.as_data(),
        "correlation_of_slenderness_and_frequency": _finite(found.correlation),
        "scatter_relative": {"value": found.overall.scatter, "standard_deviation": found.overall.scatter_error},
        "trend": {"value": _finite(found.overall.trend), "standard_deviation": _finite(found.overall.trend_error)},
        "impacts": [
            {
                "time_s": float(time),
                "rate_before_rad_s": float(rate),
                "direction": int(direction),
                "restitution": float(value),
                "standard_deviation": float(error),
            }
            for time, rate, direction, value, error in zip(
                ratio.time, ratio.rate, ratio.direction, ratio.ratio, ratio.error, strict=True
            )
        ],
        "notes": list(fit.repairs),
        "suspicions": [{"kind": item.kind, "sentence": item.sentence} for item in found.suspicions],
    }
    if contact is not None:
        result["contact"] = {
            "edge_restitution": contact.edge.estimates[RESTITUTION].as_data(),
            "edge_housner": contact.edge.housner.as_data(),
            "material": contact.material.as_data(),
            "shape": contact.shape.as_data(),
            "k_without_material": contact.k.as_data(),
            "edge_suspicions": [{"kind": s.kind, "sentence": s.sentence} for s in contact.edge.suspicions],
        }
    return result


def scene_lines(found: Calibration) -> list[str]:
    """Return `[block]` and `[uncertainty]` as a scene takes them; raises nothing: what is not known is left out."""
    estimates = found.estimates
    eta, width, height = estimates[RESTITUTION], estimates[WIDTH], estimates[HEIGHT]
    alpha, p = estimates[SLENDERNESS], estimates[FREQUENCY]
    spread = math.hypot(eta.error / eta.value, found.overall.scatter / math.sqrt(max(found.restitution.ratio.size, 1)))
    result = [
        "[block]                     # the homogeneous block that rocks as the measured one did",
        f"width_mm = {1e3 * width.value:.4f}",
        f"height_mm = {1e3 * height.value:.4f}",
        f"restitution = {min(eta.value, 1.0):.5f}",
    ]
    if found.gravity != 9.81:
        result.append(f"gravity_m_s2 = {found.gravity!r}")
    tilt = estimates.get(TILT)
    if tilt is not None and found.fit.how == HELD:
        result.append(f"# initial_rotation_deg = {math.degrees(tilt.value):.4f}    as it was let go here")
    correlated = (
        f"; slenderness and size correlate by {-found.correlation:+.2f}" if abs(found.correlation) > CORRELATED else ""
    )
    result += ["", f"[uncertainty]               # one standard deviation each{correlated}"]
    result.append(f"restitution = {{ mean = {min(eta.value, 1.0):.5f}, spread = {spread * eta.value:.2g} }}")
    if alpha.error > 0.0:
        result.append(f"slenderness_percent = {{ spread = {100.0 * alpha.error / alpha.value:.2g} }}")
    if p.error > 0.0:
        # R = 3 g / (4 p^2)
        result.append(f"size_percent = {{ spread = {200.0 * p.error / p.value:.2g} }}")
    return result


def _fitted(found: Calibration) -> str:
    fit = found.fit
    count = int(fit.flights.left.size)
    return (
        f"fitted     {count} flights, {found.restitution.ratio.size} impacts with a restitution, from "
        f"{float(np.min(fit.flights.time)):.3f} to {float(np.max(fit.flights.time)):.3f} s; residuals "
        f"{1e3 * fit.noise:.3g} mrad RMS, {fit.noise / fit.white:.2f} times the noise"
    )


def _told(value: Estimate, digits: int) -> str:
    if value.error == 0.0:
        return f"{value.value:.{digits}f} (fixed)"
    places = digits if value.error >= 10.0**-digits else min(max(digits, 1 - math.floor(math.log10(value.error))), 8)
    return f"{value.value:.{places}f} ({value.low:.{places}f} to {value.high:.{places}f})"


def _scatter(found: Calibration) -> str:
    scatter, error = found.overall.scatter, found.overall.scatter_error
    if found.restitution.ratio.size < 2:
        return "one impact: how much others scatter is a guess"
    if scatter < 2.0 * error:
        return f"impacts scatter by no more than the noise explains (below {100.0 * (scatter + 2.0 * error):.2g} %)"
    return f"impacts scatter by {100.0 * scatter:.2g} %"


def _against(found: Calibration) -> str:
    eta, housner = found.estimates[RESTITUTION].value, found.housner.value
    return f"measured is {100.0 * (eta / housner - 1.0):+.2f} %" if housner > 0.0 else "measured is above it"


def _outside(k: Estimate) -> str:
    if k.low > 1.0:
        return ": above 1, so more is lost than by any place of the impulse on the base"
    if k.high < 0.0:
        return ": below 0, so energy would be gained"
    return ""


def _nominal(found: Calibration, name: str) -> str:
    block = found.nominal
    if block is None:
        return ""
    nominal = block.slenderness if name == SLENDERNESS else block.frequency_parameter
    change = found.estimates[name].value / nominal - 1.0
    return f"; nominal {nominal:.5g}, {100.0 * change:+.2f} %"


def _size(found: Calibration) -> str:
    width, height = found.estimates[WIDTH], found.estimates[HEIGHT]
    return (
        f"{1e3 * width.value:.2f} ({1e3 * width.low:.2f} to {1e3 * width.high:.2f}) x {1e3 * height.value:.2f} "
        f"({1e3 * height.low:.2f} to {1e3 * height.high:.2f}) mm, as a homogeneous block"
    )


def _weak(found: Calibration) -> list[str]:
    alpha = found.estimates[SLENDERNESS]
    if alpha.error <= LOOSE * alpha.value:
        return []
    stiff = found.estimates[STIFFNESS]
    return [
        f"weak       slenderness and frequency parameter are hardly told apart at these rotations (correlation "
        f"{found.correlation:+.3f}); p2 sin(alpha) = {_told(stiff, 3)} 1/s2 is; give --width-mm and --height-mm with "
        "--fix or --geometry-percent"
    ]


def _tilt(found: Calibration) -> str:
    tilt = found.estimates.get(TILT)
    zero = f"; zero {1e3 * found.estimates[ZERO].value:+.3f} mrad"
    if tilt is None:
        return f"the first flight is not seen{zero}"
    how = {HELD: "let go from", "rocking": "rocks already, from"}.get(found.fit.how or "", "falls from")
    degrees = [math.degrees(value) for value in (tilt.value, tilt.low, tilt.high)]
    return f"{how} {degrees[0]:.3f} ({degrees[1]:.3f} to {degrees[2]:.3f}) deg = {tilt.value:.5f} rad{zero}"


def _impacts(found: Calibration, *, full: bool) -> list[str]:
    ratio = found.restitution
    shown = ratio.time.size if full else min(ratio.time.size, SHOWN)
    result = [
        f"impact     {time:8.4f} s  {rate:7.4f} rad/s  eta {value:.4f} +- {error:.4f}"
        for time, rate, value, error in zip(ratio.time[:shown], ratio.rate, ratio.ratio, ratio.error, strict=False)
    ]
    left = ratio.time.size - shown
    return [*result, f"           ... {left} more (--json has all)"] if left else result


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
