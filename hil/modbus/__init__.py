"""Modbus on the line: requests and replies, framing, TLS, and serial lines."""
