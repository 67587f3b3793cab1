"""A listener of a server with a fault injector in front of it, where the transport allows one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hil.server.address import NetworkAddress, PtyAddress, ServerAddress
from hil.testing.fault_injector import FaultSchedule
from hil.testing.fault_io import RtuFaultInjector, TcpFaultInjector
from hil.testing.fault_modes import MODES, Mode
from recordings import BadParameter

LOST = "lost"

HARMS: tuple[str, ...] = (*MODES, LOST)
"""What can go wrong with a line: a fault of replies, or a line that is cut."""

UNHARMED = FaultSchedule({})


def inner(address: ServerAddress) -> ServerAddress:
    """Where the server itself listens: behind an injector on a free port or a terminal of its own."""
    if isinstance(address, NetworkAddress) and _cuttable(address):
        return NetworkAddress("tcp", "127.0.0.1", 0)
    return address


def injector(address: ServerAddress, served: str) -> TcpFaultInjector | RtuFaultInjector | None:
    """What stands between clients and a listener of the server at `served`; None where nothing can."""
    if isinstance(address, NetworkAddress) and _cuttable(address):
        return TcpFaultInjector("127.0.0.1", int(served.rsplit(":", 1)[1]), UNHARMED, address.port)
    if isinstance(address, PtyAddress) and not address.link:
        return RtuFaultInjector(served.removeprefix("rtu:").partition("?")[0], UNHARMED)
    return None


def _cuttable(address: NetworkAddress) -> bool:
    """Frames of a reply can be told on plain TCP only, and the injector listens on this machine."""
    return address.kind == "tcp" and address.host == "127.0.0.1"


@dataclass(frozen=True)
class HarmedLine:
    """A line to the valves. address : where clients find it; by : its injector, None where it cannot be harmed."""

    address: str
    by: TcpFaultInjector | RtuFaultInjector | None

    @classmethod
    def of(cls, served: str, by: TcpFaultInjector | RtuFaultInjector | None) -> HarmedLine:
        """The line that an open injector, if there is one, makes of a listener's address."""
        if isinstance(by, TcpFaultInjector):
            return cls(f"tcp://127.0.0.1:{by.port}", by)
        return cls(served if by is None else f"rtu:{by.path}?parity=N", by)

    def harm(self, kind: str, share: float, how: Mapping[str, float]) -> None:
        """Let a fault befall a share of the replies, or cut the line. Raises BadParameter."""
        if self.by is None:
            found = f"the line {self.address} cannot be harmed"
            raise BadParameter("kind", kind, found, "listen on tcp://127.0.0.1:PORT, or on pty:")
        if kind == LOST:
            self.by.injector.follow(UNHARMED)
            self.by.cut()
            return
        mode = next((one for one in MODES if one == kind), None)
        if mode is None:
            raise BadParameter("kind", kind, "there is no such harm", f"there are {', '.join(HARMS)}")
        self.by.injector.follow(_schedule(mode, share, how))
        self.by.mend()

    def heal(self) -> None:
        """Let everything pass again."""
        if self.by is not None:
            self.by.injector.follow(UNHARMED)
            self.by.mend()


def _schedule(mode: Mode, share: float, how: Mapping[str, float]) -> FaultSchedule:
    known = {"delay_s": 0.2, "jitter_s": 0.01, "drip_s": 0.001}
    for name in how:
        if name not in (*known, "seed", "silence"):
            allowed = ", ".join((*known, "seed", "silence"))
            raise BadParameter("harm", name, "it is not known of a harm", f"there are {allowed}")
    times = {name: float(how.get(name, usual)) for name, usual in known.items()}
    whole = {name: int(how.get(name, usual)) for name, usual in {"seed": 0, "silence": 5}.items()}
    return FaultSchedule(
        {mode: share}, whole["seed"], times["delay_s"], times["jitter_s"], times["drip_s"], whole["silence"]
    )
