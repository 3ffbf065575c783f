"""Certificates as files, and their check."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flint import acb, arb

from contfric.base.files import replacing
from contfric.certify.diagram_certificate import LEFT_OUT
from contfric.certify.verdict import Verdict
from contfric.errors import ParameterError, ResultFileError, path_of
from contfric.events.bifurcation import Kind
from contfric.models.balls.numbers import working
from contfric.verify.file import CHECKED_MODELS, CHECKS, FORMAT, Answer, check_text

if TYPE_CHECKING:
    from contfric.certify.certificate import Certificate
    from contfric.certify.events import EventCertificate

#: Digits of a printed ball: more than the 30 that an enclosure has.
_DIGITS = 40
#: Discs of multipliers are printed this much wider: another way to compute them rounds otherwise.
_WIDER = 1e-25
#: Half-width of the ball of times about a touch.
_BESIDE = 2.0**-40
#: Share of the ball of a parameter between the two orbits that an event is shown to lie between.
_WITHIN = arb(0.9)
#: Bits with which the balls of events are printed.
_EVENT_BITS = 320
#: A larger file is no certificate: an orbit takes 4 kB, one of 400 segments 200 kB.
_LARGEST = 200_000_000


def certificate_data(certificate: Certificate) -> dict[str, Any]:
    """Return a certificate as plain data.

    Raises
    ------
    ParameterError
        If a file cannot state it (holds, a family of orbits), or the checker does not verify it.
    """
    orbit = certificate.orbit
    if not certificate.exists.proved:
        raise ParameterError(f"there is nothing to write: {certificate.why}")
    if orbit.model.name not in CHECKED_MODELS:
        from contfric.certify.law_file import law_certificate

        return law_certificate(certificate, lambda c: _orbit_data(c, lambda joints: joints))
    if orbit.system.holds:
        raise ParameterError(
            f"certificate files of {', '.join(CHECKED_MODELS)} are for orbits without holds: "
            "that is what the checker knows"
        )
    return _orbit_data(certificate, unknowns_of)


def _orbit_data(certificate: Certificate, unknowns: Callable[..., list[Any]]) -> dict[str, Any]:
    """Return a certificate as plain data, with the unknowns of some joints."""
    orbit = certificate.orbit
    with working(certificate.precision):
        radii = [float(r.upper()) * (1 + 1e-12) for r in unknowns(certificate.radii)]
        balls = [_printed(x) for x in unknowns(certificate.enclosure)]
        multipliers = [_disc(mu) for mu in sorted(certificate.multipliers, key=_rank)]
    proved = ("exists", "unique", "admissible", "stable")
    statements = [name for name in proved if getattr(certificate, name).proved]
    if certificate.stable.verdict is Verdict.REFUTED:
        statements.append("unstable")
    return {
        "certificate": "orbit",
        "format": FORMAT,
        "model": orbit.model.name,
        "params": orbit.params,
        "periods": orbit.periods,
        "half": bool(orbit.system.half),
        "segments": [list(pair) for pair in orbit.system.itinerary],
        "joints": unknowns(orbit.joints.ravel().tolist()),
        "radius": radii,
        "enclosure": balls,
        "multipliers": multipliers,
        "statements": statements,
    }


def _rank(mu: acb) -> tuple[bool, float, float]:
    """Return the place of a multiplier: the zero of a stick is last, and the upper one of a pair first."""
    upper = 0.0 if mu.imag.contains(0) else float(mu.imag)
    return bool(mu == 0), -upper, -float(mu.real)


def unknowns_of(joints: Sequence[Any]) -> list[Any]:
    """Return times and displacements of joints: every velocity is 0 there."""
    return [x for k, x in enumerate(joints) if k % 3 != 2]


def event_data(proof: EventCertificate) -> dict[str, Any]:
    """Return the certificate of an event as plain data.

    Raises
    ------
    ParameterError
        If a file cannot state it: not proved, another model, with holds, or an AS, GS or T at a joint.
    """
    event, location = proof.event, proof.location
    if not proof.proved or location is None or proof.value is None:
        raise ParameterError(f"there is nothing to write: {proof.why}")
    orbit, condition = location.orbit, location.condition
    model = orbit.model.name
    if model not in CHECKED_MODELS or orbit.system.holds:
        raise ParameterError(
            f"certificate files of events are for orbits without holds of {', '.join(CHECKED_MODELS)}: "
            "that is what the checker knows"
        )
    if condition is not None and not condition.within and event.kind not in (Kind.CS, Kind.SS):
        raise ParameterError(
            f"a {event.kind.value} at a joint has no certificate file: the checker knows others only"
        )
    size = orbit.joints.size
    with working(_EVENT_BITS):
        value = _printed(proof.value)
        radius, way = arb(value).rad(), [arb(0)] * size + [_WITHIN * arb(value).rad()]
        if event.kind is Kind.SN:  # the parameter turns on the way from one side to the other
            way = [radius.sqrt() / 64 * c for c in proof.zero[size : 2 * size]] + [arb(0)]
        middle = [*proof.zero[:size], proof.value]
        knots = [
            [_text(arb((x + side * d).mid())) for x, d in zip(middle, way, strict=True)]
            for side in (-1, 1)
        ]
        at: list[Any] | None = None
        if condition is not None and condition.within:
            at = [condition.segment, condition.surface, _text(proof.zero[-2] + arb(0, _BESIDE))]
        elif condition is not None:
            at = [condition.segment, 1 if condition.surface == "F+" else -1]
    return {
        "certificate": "event",
        "format": FORMAT,
        "model": model,
        "params": {k: v for k, v in event.params.items() if k != proof.parameter},
        "parameter": proof.parameter,
        "kind": event.kind.value,
        "value": value,
        "periods": orbit.periods,
        "half": bool(orbit.system.half),
        "segments": [list(pair) for pair in orbit.system.itinerary],
        "knots": [[*unknowns_of(knot[:-1]), knot[-1]] for knot in knots],
        "at": at,
    }


def checked(proof: Certificate | EventCertificate) -> tuple[dict[str, Any] | None, str]:
    """Return what is proved as plain data for a file; or None, and why a file cannot have it.

    An event that the checker does not verify is left out: where two happen at once (an SS at which a
    multiplier is -1, too) a file of one would be refused with all that stands next to it.
    """
    from contfric.certify.certificate import Certificate

    if not proof.proved:
        return None, "it is not proved"
    if isinstance(proof, Certificate) and proof.orbit.model.name not in CHECKED_MODELS:
        return None, "an orbit of a declared model has a file of its own only"
    try:
        data = certificate_data if isinstance(proof, Certificate) else event_data
        part = data(proof)  # type: ignore[arg-type] # each has its own
    except ParameterError as error:  # none of those that the checker knows
        return None, str(error)
    answer = check_text(json.dumps(part)) if part["certificate"] == "event" else None
    if answer is not None and not answer.yes:
        return None, f"the checker refuses it: {answer.why}"
    return part, ""


def checkable(proofs: Iterable[Certificate | EventCertificate | None]) -> list[dict[str, Any]]:
    """Return those certificates that are proved and that the checker knows, as plain data."""
    found = [checked(proof)[0] for proof in proofs if proof is not None]
    return [part for part in found if part is not None]


def told_apart(
    parts: Iterable[dict[str, Any]],
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the parts that a file can have, and the orbits that the checker does not tell from one of these.

    At an event orbits of two branches meet, and at its printed parameters they may be one to all digits.
    """
    kept, same = list[dict[str, Any]](), list[dict[str, Any]]()
    orbits: dict[tuple[tuple[str, float], ...], list[dict[str, Any]]] = {}
    for part in parts:
        if part["certificate"] == "orbit":
            there = orbits.setdefault(tuple(sorted(part["params"].items())), [])
            pairs = ({"certificate": "diagram", "checkable": [one, part]} for one in there)
            if not all(check_text(json.dumps(pair)).yes for pair in pairs):
                same.append(part)
                continue
            there.append(part)
        kept.append(part)
    return kept, same


def left_out(path: Any) -> list[str]:
    """Return the events and orbits that a file does not have although they are proved, each with the reason.

    Older files do not say.
    """
    data = json.loads(path_of("a certificate file", path).read_text(encoding="utf-8"))
    return [str(text) for text in data.get(LEFT_OUT, ())]


def _printed(x: arb) -> str:
    """Return a ball as a text, which contains it."""
    return _text(x + arb(0, (_WIDER * 1e-5) * (1 + abs(x).upper())))


def _text(x: arb) -> str:
    """Return ``centre +/- radius`` in decimals that contain a ball."""
    return str(x.str(_DIGITS, more=True)).strip("[]")


def _disc(mu: acb) -> dict[str, str]:
    width = _WIDER * (1 + abs(mu).upper())
    parts = (mu.real + arb(0, width), mu.imag + arb(0, width))
    return {name: _text(part) for name, part in zip(("re", "im"), parts, strict=True)}


def write_certificate(certificate: Certificate, path: Any) -> None:
    """Write a certificate as a JSON file.

    Raises
    ------
    ResultFileError
        If it cannot be written.
    """
    write_data(certificate_data(certificate), path)


def write_data(data: dict[str, Any], path: Any) -> None:
    """Write plain data as a JSON file.

    Raises
    ------
    ResultFileError
        If it cannot be written.
    """
    text = json.dumps(data, indent=1)
    with replacing(path_of("a certificate file", path)) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def _what_else(text: str) -> str:
    """Return why a text is not one of the certificates that the checker knows; nothing if it is one."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return "it is no JSON file" if text.strip() else "it is empty"
    kinds = (*CHECKS, "diagram")
    if not isinstance(data, dict) or "certificate" not in data:
        return "it is a JSON file without the entry 'certificate'"
    if data["certificate"] not in kinds:
        return f"its entry 'certificate' is not one of {', '.join(kinds)}"
    parts = data.get("checkable") if data["certificate"] == "diagram" else [data]
    formats = {str(part.get("format")) for part in parts or () if isinstance(part, dict)}
    if formats - {str(FORMAT)}:
        others = ", ".join(sorted(formats - {str(FORMAT)}))
        return f"it has format {others[:40]}, and format {FORMAT} is checked; write it anew"
    return ""


def _unstated(text: str) -> str:
    """Return which event the summary of a diagram calls checkable though no part of the file states it."""
    data = json.loads(text)
    if data["certificate"] != "diagram" or "summary" not in data:
        return ""
    with working(_EVENT_BITS):
        parts = [p for p in data["checkable"] if p["certificate"] == "event"]
        stated = [(p["kind"], arb(p["value"])) for p in parts]
        try:
            for event in data["summary"]["events"]:
                if not event["checkable"] or event["why"]:
                    continue
                ball = arb(event["ball"])
                same = [x for x in stated if x[0] == event["kind"] and x[1].contains(ball)]
                if not same:
                    return f"{event['label']} at {event['ball']}"
                stated.remove(same[0])
        except (KeyError, TypeError, ValueError) as error:
            return f"an event that cannot be read ({error!r})"
    return ""


def checked_text(text: str) -> Answer:
    """Check a text by the checker that knows its kind: with a law of its own, or of a known model."""
    from contfric.verify.piecewise import check_text as check_law

    return (check_law if '"equations"' in text else check_text)(text)


def verify(path: Any) -> Answer:
    """Check a certificate file by the independent checker.

    Raises
    ------
    ResultFileError
        If the file cannot be read.
    """
    file: Path = path_of("a certificate file", path)
    try:
        if file.stat().st_size > _LARGEST:
            raise ResultFileError(f"{file} is too large for a certificate")
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultFileError(
            f"cannot read {file}: {error}; give the path of a certificate"
        ) from error
    except UnicodeDecodeError:
        return Answer(False, f"{file.name} is no certificate: it is no text")
    answer = checked_text(text)
    unstated = _unstated(text) if answer.yes else ""
    if unstated:
        return Answer(
            False, f"no part of the file states what its summary calls checkable: {unstated}"
        )
    other = "" if answer.yes else _what_else(text)
    if other:
        return answer._replace(why=f"{file.name} is no certificate: {other}")
    if not answer.yes and '"checkable": []' in text:  # of another model, or all orbits have holds
        why = (
            "it has no statement that is checked here. Checked are orbits without holds of the model "
            f"{', '.join(CHECKED_MODELS)}, their events and branches; of others it has the summary only "
            "(an orbit of a declared model has a file of its own: orbit.certify().save)"
        )
        return answer._replace(why=why)
    return answer
