"""What goes wrong on purpose, for tests of a client or a server: a fault injector between the two, and certificates.

>>> injector = FaultInjector(FaultSchedule({"drop": 1.0}), "tcp")
>>> injector.reply(bytes.fromhex("0001 0000 0003 01 83 02"))
[]
"""

from hil.modbus.framing import crc
from hil.testing.fault_injector import FaultInjector, FaultSchedule
from hil.testing.fault_io import RtuFaultInjector, TcpFaultInjector
from hil.testing.fault_modes import MODES, Action, Close, Mode, Send
from hil.testing.frame_cutter import FrameCutter
from hil.testing.loopback_authority import LoopbackAuthority, make_loopback_authority

__all__ = [
    "MODES",
    "Action",
    "Close",
    "FaultInjector",
    "FaultSchedule",
    "FrameCutter",
    "LoopbackAuthority",
    "Mode",
    "RtuFaultInjector",
    "Send",
    "TcpFaultInjector",
    "crc",
    "make_loopback_authority",
]
