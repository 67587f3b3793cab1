"""A Modbus server of plants: listeners, requests in turn, registers from a map, and a session until a signal."""
