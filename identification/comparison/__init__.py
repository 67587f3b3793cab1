"""What has changed between two recordings, or two models, of one valve, beyond noise and repeatability."""
