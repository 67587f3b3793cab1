"""The address of a source: every form is understood, and every mistake is one line that says what to write."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil import SerialLine, parse_address
from recordings import BadInput


def test_every_form_is_understood():
    tcp = parse_address("tcp://[::1]:5020?timeout=0.2")
    assert (tcp.host, tcp.port, tcp.timeout) == ("::1", 5020, 0.2)
    tls = parse_address("tls://plc.example?ca=ca.pem&cert=own.pem&key=own.key&name=plc")
    assert (tls.host, tls.port, tls.ca, tls.name) == ("plc.example", 802, Path("ca.pem"), "plc")
    rtu = parse_address("rtu:/dev/ttyUSB0?baud=9600&parity=n&stop=2&timeout=1&quiet=3")
    assert (rtu.line, rtu.quiet) == (SerialLine("/dev/ttyUSB0", 9600, "N", 2), 3.0)
    replay = parse_address("replay:runs/a b.h5?pace=2.5")
    assert (replay.path, replay.pace) == (Path("runs/a b.h5"), 2.5)


def test_a_line_is_quiet_for_as_long_as_its_timeout_unless_told_otherwise():
    assert parse_address("rtu:/dev/ttyS0?timeout=2").quiet == 2.0


@pytest.mark.parametrize(
    ("options", "gap"),
    [("baud=9600&parity=E", 3.5 * 11 / 9600), ("baud=9600&parity=N&stop=1", 3.5 * 10 / 9600), ("baud=115200", 1.75e-3)],
)
def test_the_gap_between_frames_is_that_of_the_standard(options, gap):
    assert parse_address(f"rtu:/dev/ttyS0?{options}").line.gap == pytest.approx(gap)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "kind of source"),
        ("udp://host:1", "'udp' is not a kind of source"),
        ("/dev/ttyUSB0", "kind of source"),
        ("tcp:", "no host"),
        ("tcp:127.0.0.1:502", "no host"),
        ("tcp://:502", "no host"),
        ("tcp://host:port", "port is not a number"),
        ("tcp://host:70000", "port is not a number"),
        ("tcp://host:0", "port 0"),
        ("tcp://host/path", "no host"),
        ("tcp://user@host", "no host"),
        ("tcp://host?timeout=0", "timeout is '0'"),
        ("tcp://host?timeout=fast", "timeout is 'fast'"),
        ("tcp://host?timeout=nan", "timeout is 'nan'"),
        ("tcp://host?timout=1", "did you mean 'timeout'"),
        ("tcp://host?timeout", "are not options"),
        ("tcp://host?timeout=1&timeout=2", "twice"),
        ("tls://host?ca=ca.pem&cert=own.pem", "option 'key' is missing"),
        ("rtu:", "no serial device"),
        ("rtu://dev/ttyS0", "no serial device"),
        ("rtu:/dev/ttyS0?parity=X", "parity is one of N, E, O"),
        ("rtu:/dev/ttyS0?parity=", "parity is one of N, E, O"),
        ("rtu:/dev/ttyS0?baud=fast", "baud"),
        ("rtu:/dev/ttyS0?baud=9600.5", "whole number"),
        ("rtu:/dev/ttyS0?stop=3", "stop"),
        ("replay:", "no recording"),
        ("replay:a.h5?pace=0", "pace"),
        ("replay:a.h5?rate=1", "'rate' is not known"),
    ],
)
def test_a_mistake_is_named_with_what_to_write_instead(text, words):
    with pytest.raises(BadInput, match=words) as problem:
        parse_address(text)
    assert problem.value.remedy
    assert "\n" not in str(problem.value)
