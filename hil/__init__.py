"""The wire: simulated valves behind Modbus, and real ones read, recorded and watched.

One Modbus reply becomes a stored value in these folders, in this order: ``modbus`` (messages, frames, addresses, TLS,
serial lines), ``client`` (a link that stays open), ``registers`` (what registers mean), ``source`` (samples with a
quality for every value), ``recorder`` (files) and ``monitor`` (events); ``service`` does it for many valves and for
years, and ``page`` shows it. ``plant`` and ``server`` are the other end of the line, ``testing`` what goes wrong on it.
`BackgroundServer` and `BackgroundRecorder` are for programs without an event loop.
"""

from hil.background import BackgroundRecorder, BackgroundServer
from hil.client.state import BackOff, LinkState
from hil.modbus.addresses import SerialLine
from hil.modbus.tls import Certificates
from hil.monitor.event import MonitorEvent
from hil.monitor.monitor import Monitor
from hil.monitor.session import MonitorEnd, MonitorSession, monitor_session
from hil.monitor.state import load_state, save_state
from hil.monitor.valve import WatchStatus
from hil.page.access import PageSettings
from hil.page.shown_monitor import ShownMonitor
from hil.page.task import Page
from hil.plant.actuator import ActuatorPlant, ActuatorSetup
from hil.plant.pace import Lateness, LatenessReport, Pace
from hil.plant.plant import Command, ServedPlant
from hil.recorder.files import RecorderSettings
from hil.recorder.recorder import Recorder, RecorderReport, ValveReport
from hil.recorder.session import RecorderEnd, record_session
from hil.registers.codec import Decoded, decode, encode
from hil.registers.map_file import locate as map_file
from hil.registers.map_file import shipped as map_names
from hil.registers.map_table import describe_register_map, register_map_page
from hil.registers.point import Point
from hil.registers.register_map import ReadBlock, RegisterMap, WriteMap
from hil.registers.ring import Ring
from hil.server.address import NetworkAddress, PtyAddress, ServerAddress, listen_address
from hil.server.server import Server, ServerSettings
from hil.server.session import ServerEnd, serve_session
from hil.service.plan import ServicePlan
from hil.service.plant_file import PlantFile
from hil.service.service import Service, ServiceOutlets, ServiceTask
from hil.service.session import ServiceEnd, ServiceSession, http_address, run_service
from hil.service.status import Health, LinkStatus, PlantStatus, RecentSamples, TaskStatus, ValveStatus
from hil.source.address import live_address, parse_address
from hil.source.live import LiveSource, PollingStopped
from hil.source.polling import Polling
from hil.source.probe import ProbedPoint, ProbedValve, probe
from hil.source.replay import ReplaySource
from hil.source.ring_reading import RingReading
from hil.source.sample import LinkEvent, Quality, Reading, Sample
from hil.source.source import Source, SourceWrapper, open_source
from hil.source.statistics import Statistics
from hil.source.valve import Valve, valves_of

__all__ = [
    "ActuatorPlant",
    "ActuatorSetup",
    "BackOff",
    "BackgroundRecorder",
    "BackgroundServer",
    "Certificates",
    "Command",
    "Decoded",
    "Health",
    "Lateness",
    "LatenessReport",
    "LinkEvent",
    "LinkState",
    "LinkStatus",
    "LiveSource",
    "Monitor",
    "MonitorEnd",
    "MonitorEvent",
    "MonitorSession",
    "NetworkAddress",
    "Pace",
    "Page",
    "PageSettings",
    "PlantFile",
    "PlantStatus",
    "Point",
    "Polling",
    "PollingStopped",
    "ProbedPoint",
    "ProbedValve",
    "PtyAddress",
    "Quality",
    "ReadBlock",
    "Reading",
    "RecentSamples",
    "Recorder",
    "RecorderEnd",
    "RecorderReport",
    "RecorderSettings",
    "RegisterMap",
    "ReplaySource",
    "Ring",
    "RingReading",
    "Sample",
    "SerialLine",
    "ServedPlant",
    "Server",
    "ServerAddress",
    "ServerEnd",
    "ServerSettings",
    "Service",
    "ServiceEnd",
    "ServiceOutlets",
    "ServicePlan",
    "ServiceSession",
    "ServiceTask",
    "ShownMonitor",
    "Source",
    "SourceWrapper",
    "Statistics",
    "TaskStatus",
    "Valve",
    "ValveReport",
    "ValveStatus",
    "WatchStatus",
    "WriteMap",
    "decode",
    "describe_register_map",
    "encode",
    "http_address",
    "listen_address",
    "live_address",
    "load_state",
    "map_file",
    "map_names",
    "monitor_session",
    "open_source",
    "parse_address",
    "probe",
    "record_session",
    "register_map_page",
    "run_service",
    "save_state",
    "serve_session",
    "valves_of",
]
