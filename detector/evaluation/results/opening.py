"""What the page of an evaluation opens with: the best detector, how sure that is, and what to do next."""

from __future__ import annotations

from html import escape

from detector.evaluation.outcome import Evaluation
from detector.evaluation.results.verdicts import detected
from detector.page import dated, opening_html
from recordings import OpeningWord, ReportOpening

KEY = (
    "Key: fN-abrupt or fN-incipient is fault N of the DAMADICS benchmark, sudden or growing; play and lugre are two "
    "forms of friction, the number behind them the sampling rate in hertz; rtd and rfd are the shares of the faulty "
    "and of the fault-free time with an alarm. Published results: P1 Papadimitropoulos, Rovithakis and Parisini "
    "(2003), R1 Patan and Parisini (2003), R2 Mrugalski, Arinton and Korbicz (2003), R3 Rzepiejewski, Syfert and "
    "Jegorov (2003), R4 Almeida and Park (2008), R5 Bahrampour, Moshiri and Salahshoor (2011), R6 a self-organising "
    "map (IJSCE, 2011)."
)


def opening(outcome: Evaluation) -> str:
    """Verdict, confidence and next action, as HTML."""
    variant = outcome.plan.variants[0]
    scenarios = outcome.trials[variant]
    seen = {
        detector: sum(detected(outcome, variant, name, detector)[2] for name in scenarios)
        for detector in outcome.plan.detectors
    }
    best = max(seen, key=lambda detector: seen[detector])
    false, hours = outcome.healthy[variant][best], outcome.hours[variant]
    rate = outcome.plan.rate_per_h
    kept = false <= max(3.0 * rate * hours, 1.0)
    whole = seen[best] == len(scenarios)
    word: OpeningWord = "good" if kept and whole else "watch" if kept else "repair"
    why = f"{best} sees {seen[best]} of {len(scenarios)} scenarios, the most of {len(seen)} detectors"
    sure = (
        f"{false} false alarms in {hours:.1f} fault-free hours, {rate:g} an hour stated; "
        f"{outcome.plan.seeds} trials of each scenario"
    )
    action = f"use {best}" if kept and whole else "see what is missed, and why, before relying on it" if kept else (
        f"do not use {best} at this rate: it raises more false alarms than stated"
    )  # fmt: skip
    about = dated("DAMADICS benchmark actuator, simulated.")
    return f"{about}{opening_html(ReportOpening(word, why, sure, action))}<p class='note'>{escape(KEY)}</p>"
