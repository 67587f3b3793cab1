"""What goes wrong on purpose: a fault injector and a test authority."""
