"""Reference lengths and places of an aircraft."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.code import Code
from tussle.aircraft.node import Element


@dataclass(frozen=True)
class Metrics:
    """Reference lengths [ft], areas [ft^2], incidence of the wing [rad], places in the structural frame [in]."""

    area: float
    span: float
    chord: float
    incidence: float
    tail_arm: float
    tail_area: float
    fin_arm: float
    fin_area: float
    reference: tuple[float, float, float]
    eye: tuple[float, float, float]
    visual: tuple[float, float, float]


def read_metrics(node: Element) -> Metrics:
    """Read <metrics>.

    Raises:
        AircraftError: A number is none.
    """
    places = {each.get("name"): each.vector("IN") for each in node.find_all("location")}
    zero = 0.0, 0.0, 0.0
    return Metrics(
        node.value("wingarea", 0.0, "FT2"), node.value("wingspan", 0.0, "FT"), node.value("chord", 0.0, "FT"),
        node.value("wing_incidence", 0.0, "RAD"), node.value("htailarm", 0.0, "FT"), node.value("htailarea", 0.0, "FT2"),
        node.value("vtailarm", 0.0, "FT"), node.value("vtailarea", 0.0, "FT2"),
        places.get("AERORP", zero), places.get("EYEPOINT", zero), places.get("VRP", zero),
    )  # fmt: skip


def offer_metrics(code: Code, m: Metrics) -> None:
    """Make the properties of the metrics constants."""
    code.constants |= {
        "metrics/Sw-sqft": m.area, "metrics/bw-ft": m.span, "metrics/cbarw-ft": m.chord, "metrics/iw-rad": m.incidence,
        "metrics/iw-deg": math.degrees(m.incidence), "metrics/lh-ft": m.tail_arm, "metrics/Sh-sqft": m.tail_area,
        "metrics/lv-ft": m.fin_arm, "metrics/Sv-sqft": m.fin_area,
        "metrics/aero-rp-x-in": m.reference[0], "metrics/aero-rp-y-in": m.reference[1], "metrics/aero-rp-z-in": m.reference[2],
        "metrics/eyepoint-x-in": m.eye[0], "metrics/eyepoint-y-in": m.eye[1], "metrics/eyepoint-z-in": m.eye[2],
        "metrics/visualrefpoint-x-in": m.visual[0], "metrics/visualrefpoint-y-in": m.visual[1], "metrics/visualrefpoint-z-in": m.visual[2],
    }  # fmt: skip
    if m.chord:
        code.constants |= {"metrics/lh-norm": m.tail_arm / m.chord, "metrics/lv-norm": m.fin_arm / m.chord}
        if m.area:
            code.constants["metrics/vbarh-norm"] = m.tail_arm * m.tail_area / (m.chord * m.area)
    if m.span and m.area:
        code.constants["metrics/vbarv-norm"] = m.fin_arm * m.fin_area / (m.span * m.area)
