"""What a server can serve: the interface of a plant, the simulated actuator, and plant time against the clock."""
