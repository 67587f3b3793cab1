"""Simulated plants behind Modbus registers."""
