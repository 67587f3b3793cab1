"""What `bristle serve` says and how it ends."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from typer import Exit

from bristle.cli.output.manner import answer, note, say
from hil import ActuatorPlant, Certificates, NetworkAddress, ServerAddress, ServerSettings, serve_session
from hil.testing import bench_session, make_loopback_authority
from recordings import BadInput

LONGEST_S = 3600.0
"""How long a server in the background lasts when nothing else is said [s]."""


def make_certificates(folder: Path) -> None:
    """Write the certificates of a test authority and say how to use them. Raises BadInput."""
    made = make_loopback_authority(folder)
    server, client = made.server, made.client
    answer({side: asdict(one) for side, one in (("server", made.server), ("client", made.client))})
    say(f"server: --cert {server.certificate} --key {server.key} --ca {server.authority}")
    say(f"client: cert={client.certificate}&key={client.key}&ca={client.authority}")
    note("They vouch for localhost, 127.0.0.1 and ::1 only, for 30 days. Keep the keys to yourself.")


def certificates(
    addresses: Sequence[ServerAddress], cert: Path | None, key: Path | None, ca: Path | None
) -> Certificates | None:
    """The certificates of the options; None when no address needs any. Raises BadInput for a missing option."""
    if not any(isinstance(address, NetworkAddress) and address.kind == "tls" for address in addresses):
        return None
    if cert is None or key is None or ca is None:
        missing = next(name for name, path in (("--cert", cert), ("--key", key), ("--ca", ca)) if path is None)
        remedy = "tls:// needs --cert, --key and --ca (for tests: bristle serve --make-test-ca DIR)"
        raise BadInput(missing, "it is missing", remedy)
    return Certificates(cert, key, ca)


def run(
    plants: Mapping[int, ActuatorPlant], settings: ServerSettings, duration: float | None, control: int | None = None
) -> None:
    """Serve; SIGTERM is the regular end, Ctrl-C an interruption. control : port for control, None for none."""
    for warning in settings.exposure():
        note(f"bristle: {warning}")
    if control is None:
        end = asyncio.run(serve_session(plants, settings, duration, _say))
    else:
        end = asyncio.run(bench_session(plants, settings, duration, _say, control))
    if end.stopped_by == signal.SIGINT:
        raise KeyboardInterrupt


def _say(line: str) -> None:
    """Print a line; whoever read the first one may be gone when the last one comes."""
    with suppress(BrokenPipeError):
        print(line, flush=True)


def detach(typed: Sequence[str], duration: float | None) -> None:
    """Start a command once more, as it was typed, in a session of its own; print its first line with ``pid``.

    It is given a control port, and `LONGEST_S` where no duration was asked for: nobody else may end it. What it says
    before its first line goes to stderr. Raises Exit with its exit code when it ends at once.
    """
    words = [word for word in typed if word != "--background"]
    words += [] if any(word.startswith("--control") for word in words) else ["--control", "0"]
    words += [] if duration is not None else ["--duration", f"{LONGEST_S:g}"]
    command = [sys.executable, "-m", "bristle", *words]
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said, start_new_session=True, text=True
        )
        assert process.stdout is not None
        line = process.stdout.readline()
        said.seek(0)
        print(said.read(), end="", file=sys.stderr)
    if not line:
        raise Exit(process.wait())
    print(json.dumps(json.loads(line) | {"pid": process.pid}), flush=True)
