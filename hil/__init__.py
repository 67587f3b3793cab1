"""The wire: register maps, the served plant, and what stands between it and the rest."""

from hil.background import BackgroundRecorder, BackgroundServer
from hil.client.state import BackOff, LinkState
from hil.modbus.addresses import SerialLine
from hil.modbus.tls import Certificates
from hil.monitor.event import MonitorEvent
from hil.monitor.monitor import Monitor
from hil.monitor.session import MonitorEnd, MonitorSession, monitor_session
from hil.monitor.state import load_state, save_state
from hil.monitor.valve import ValveStatus
from hil.plant.actuator import ActuatorPlant, ActuatorSetup
from hil.plant.options import ActuatorOptions
from hil.plant.pace import Lateness, LatenessReport, Pace
from hil.plant.plant import Command, Plant
from hil.recorder.files import RecorderSettings
from hil.recorder.recorder import Recorder, RecorderReport, ValveReport
from hil.recorder.session import SessionEnd, record_session
from hil.registers.codec import Decoded, decode, encode
from hil.registers.map_table import describe_register_map, register_map_page
from hil.registers.point import Point
from hil.registers.register_map import ReadBlock, RegisterMap, WriteMap
from hil.registers.ring import Ring
from hil.server.address import NetworkAddress, PtyAddress, ServerAddress, listen_address
from hil.server.server import Server, ServerSettings
from hil.server.session import ServerEnd, serve_session
from hil.source.address import parse_address
from hil.source.live import LiveSource, PollingDied
from hil.source.polling import Polling
from hil.source.replay import ReplaySource
from hil.source.ring import RingReading
from hil.source.sample import LinkEvent, Quality, Reading, Sample
from hil.source.source import Around, Source, open_source
from hil.source.statistics import Statistics
from hil.source.valve import Valve, valves_of
from hil.testing.authority import TestAuthority, make_test_authority
from hil.testing.fault_frames import FrameCutter, crc
from hil.testing.fault_injector import FaultInjector, FaultSchedule
from hil.testing.fault_io import RtuFaultInjector, TcpFaultInjector
from hil.testing.fault_modes import MODES, Action, Close, Mode, Send

__all__ = [
    "MODES",
    "Action",
    "ActuatorOptions",
    "ActuatorPlant",
    "ActuatorSetup",
    "Around",
    "BackOff",
    "BackgroundRecorder",
    "BackgroundServer",
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
    "SerialLine",
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
