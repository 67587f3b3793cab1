"""What detectors are judged on: runs of the actuator, examples of faults, a measured hour, published results."""
