"""Events to an MQTT broker, at least once, under TOPIC/TAG. Needs paho-mqtt (pip install 'bristle[mqtt]')."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hil.monitor.event import MonitorEvent
from hil.service.plant_file import MqttEntry, PlantFile
from recordings import BadInput, not_installed

PATIENCE_S = 10.0
"""How long a broker may take to confirm an event."""


class MqttSink:
    """Publishes each event as one JSON message with quality of service 1.

    entry : the broker; plant : whose file names it. Raises BadInput when paho-mqtt is not installed, or the password
    file cannot be read.
    """

    def __init__(self, entry: MqttEntry, plant: PlantFile) -> None:
        self.name = f"events mqtt://{entry.host}:{entry.port}"
        self._entry = entry
        self._client: Any = None
        self._password = _first_line(plant.path(entry.password_file)) if entry.password_file else None
        self._ca = str(plant.path(entry.ca)) if entry.ca else None
        try:
            import paho.mqtt.client as mqtt
            from paho.mqtt.enums import CallbackAPIVersion
        except ImportError:
            where = f"{plant.file}: events.mqtt"
            raise not_installed(where, "a broker", "paho-mqtt", "mqtt", "leave it out") from None
        self._new: Callable[[], Any] = lambda: mqtt.Client(CallbackAPIVersion.VERSION2)

    def send(self, events: Sequence[MonitorEvent]) -> None:
        """Publish them. Raises ConnectionError when the broker does not confirm in time."""
        client = self._connected()
        for event in events:
            topic = f"{self._entry.topic}/{_level(event.valve)}"
            message = client.publish(topic, event.json_line(), qos=1)
            message.wait_for_publish(PATIENCE_S)
            if not message.is_published():
                self.close()
                raise ConnectionError(f"the broker did not confirm an event within {PATIENCE_S:g} s")

    def close(self) -> None:
        """Leave the broker."""
        client, self._client = self._client, None
        if client is not None:
            client.disconnect()
            client.loop_stop()

    def _connected(self) -> Any:
        if self._client is None:
            entry = self._entry
            client = self._new()
            client.username_pw_set(entry.username, self._password)
            if self._ca:
                client.tls_set(self._ca)
            client.connect(entry.host, entry.port, keepalive=30)
            client.loop_start()
            self._client = client
        return self._client


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").splitlines()[0]
    except (OSError, IndexError, UnicodeDecodeError) as error:
        raise BadInput(str(path), f"no password can be read ({error})", "give a file with one line") from None


def _level(tag: str) -> str:
    """A tag as one level of a topic: what has a meaning there is replaced."""
    return "".join("_" if letter in "/#+\0" else letter for letter in tag)
