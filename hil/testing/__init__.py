"""What goes wrong on purpose, for tests of a client, a server or a controller: simulated valves, faults, certificates.

`SimulatedValve` is a valve behind Modbus whose time, faults and line a test has in its hands, `Bench` the same for
several and for programs with an event loop, and `ControlPort` offers it to other languages.

>>> injector = FaultInjector(FaultSchedule({"drop": 1.0}), "tcp")
>>> injector.reply(bytes.fromhex("0001 0000 0003 01 83 02"))
[]
"""

from hil.modbus.framing import crc
from hil.testing.bench.bench import Bench
from hil.testing.bench.control import ControlPort, bench_session
from hil.testing.bench.device import Device
from hil.testing.bench.harmed_line import HARMS
from hil.testing.bench.valve import NotReached, SimulatedValve
from hil.testing.fault_injector import FaultInjector, FaultSchedule
from hil.testing.fault_io import RtuFaultInjector, TcpFaultInjector
from hil.testing.fault_modes import MODES, Action, Close, Mode, Send
from hil.testing.frame_cutter import FrameCutter
from hil.testing.loopback_authority import LoopbackAuthority, make_loopback_authority

__all__ = [
    "HARMS",
    "MODES",
    "Action",
    "Bench",
    "Close",
    "ControlPort",
    "Device",
    "FaultInjector",
    "FaultSchedule",
    "FrameCutter",
    "LoopbackAuthority",
    "Mode",
    "NotReached",
    "RtuFaultInjector",
    "Send",
    "SimulatedValve",
    "TcpFaultInjector",
    "bench_session",
    "crc",
    "make_loopback_authority",
]
