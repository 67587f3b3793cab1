"""What `bristle serve` says and how it ends."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from bristle.cli.output.manner import answer, note, say
from hil import Certificates, NetworkAddress, ServedPlant, ServerAddress, ServerSettings, serve_session
from hil.testing import make_loopback_authority
from recordings import BadInput


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


def run(plants: Mapping[int, ServedPlant], settings: ServerSettings, duration: float | None) -> None:
    """Serve; SIGTERM is the regular end, Ctrl-C an interruption."""
    for warning in settings.exposure():
        note(f"bristle: {warning}")
    end = asyncio.run(serve_session(plants, settings, duration, lambda line: print(line, flush=True)))
    if end.stopped_by == signal.SIGINT:
        raise KeyboardInterrupt
