"""The wire: register maps, the served plant, and what stands between it and the rest."""

from hil._codec import Decoded, decode, encode
from hil._fault_injector import FaultInjector, FaultSchedule
from hil._fault_injector_frames import FrameCutter, crc
from hil._fault_injector_io import RtuFaultInjector, TcpFaultInjector
from hil._fault_injector_modes import MODES, Action, Close, Mode, Send
from hil._link_state import BackOff, LinkState
from hil._monitor import Monitor
from hil._monitor_event import MonitorEvent
from hil._monitor_session import MonitorEnd, MonitorSession, monitor_session
from hil._monitor_state import load_state, save_state
from hil._monitor_valve import ValveStatus
from hil._pace import Lateness, LatenessReport, Pace
from hil._plant import Command, Plant
from hil._plant_actuator import ActuatorPlant, ActuatorSetup
from hil._plant_options import ActuatorOptions
from hil._point import Point
from hil._recorder import Recorder, RecorderReport, ValveReport
from hil._recorder_files import RecorderSettings
from hil._recorder_session import SessionEnd, record_session
from hil._register_map import ReadBlock, RegisterMap, WriteMap
from hil._register_map_table import describe_register_map, register_map_page
from hil._ring import Ring
from hil._sample import LinkEvent, Quality, Reading, Sample
from hil._server import Server, ServerSettings
from hil._server_address import NetworkAddress, PtyAddress, SerialAddress, ServerAddress, listen_address
from hil._server_session import ServerEnd, serve_session
from hil._source import Around, Source, open_source
from hil._source_address import parse_address
from hil._source_live import LiveSource, PollingDied
from hil._source_polling import Polling
from hil._source_replay import ReplaySource
from hil._source_ring import RingReading
from hil._source_statistics import Statistics
from hil._source_valve import Valve, valves_of
from hil._tls import Certificates
from hil._tls_test_authority import TestAuthority, make_test_authority

__all__ = [
    "MODES",
    "Action",
    "ActuatorOptions",
    "ActuatorPlant",
    "ActuatorSetup",
    "Around",
    "BackOff",
    "Certificates",
    "Close",
    "Command",
    "Decoded",
    "FaultInjector",
    "FaultSchedule",
    "FrameCutter",
    "Lateness",
    "LatenessReport",
    "LinkEvent",
    "LinkState",
    "LiveSource",
    "Mode",
    "Monitor",
    "MonitorEnd",
    "MonitorEvent",
    "MonitorSession",
    "NetworkAddress",
    "Pace",
    "Plant",
    "Point",
    "Polling",
    "PollingDied",
    "PtyAddress",
    "Quality",
    "ReadBlock",
    "Reading",
    "Recorder",
    "RecorderReport",
    "RecorderSettings",
    "RegisterMap",
    "ReplaySource",
    "Ring",
    "RingReading",
    "RtuFaultInjector",
    "Sample",
    "Send",
    "SerialAddress",
    "Server",
    "ServerAddress",
    "ServerEnd",
    "ServerSettings",
    "SessionEnd",
    "Source",
    "Statistics",
    "TcpFaultInjector",
    "TestAuthority",
    "Valve",
    "ValveReport",
    "ValveStatus",
    "WriteMap",
    "crc",
    "decode",
    "describe_register_map",
    "encode",
    "listen_address",
    "load_state",
    "make_test_authority",
    "monitor_session",
    "open_source",
    "parse_address",
    "record_session",
    "register_map_page",
    "save_state",
    "serve_session",
    "valves_of",
]
