"""Modbus on the line: messages, frames and what a reply must be; addresses, TLS and serial lines."""
