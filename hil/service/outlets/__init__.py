"""Where findings go: events to files, programs and brokers, numbers to Prometheus, signs of life to systemd."""
