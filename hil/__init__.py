"""The wire: register maps, the served plant, and what stands between it and the rest."""

from hil._codec import Decoded, decode, encode
from hil._fault_injector import FaultInjector, FaultSchedule
from hil._fault_injector_io import RtuFaultInjector, TcpFaultInjector
from hil._fault_injector_modes import MODES, Action, Close, Mode, Send
from hil._pace import Lateness, Pace, Report
from hil._plant import Command, Plant
from hil._point import Point
from hil._register_map import ReadBlock, RegisterMap, WriteMap
from hil._register_map_table import describe_register_map
from hil._ring import Ring
from hil._server import Server, ServerSettings
from hil._server_address import listen_address
from hil._tls import Certificates
from hil._tls_test_authority import TestAuthority, make_test_authority

__all__ = [
    "MODES",
    "Action",
    "Certificates",
    "Close",
    "Command",
    "Decoded",
    "FaultInjector",
    "FaultSchedule",
    "Lateness",
    "Mode",
    "Pace",
    "Plant",
    "Point",
    "ReadBlock",
    "RegisterMap",
    "Report",
    "Ring",
    "RtuFaultInjector",
    "Send",
    "Server",
    "ServerSettings",
    "TcpFaultInjector",
    "TestAuthority",
    "WriteMap",
    "decode",
    "describe_register_map",
    "encode",
    "listen_address",
    "make_test_authority",
]
