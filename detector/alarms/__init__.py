"""Alarm levels for a stated rate of false alarms, and the rate that they have."""
