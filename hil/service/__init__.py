"""The monitor as a service: many valves, supervised tasks, and what they show to a page, to metrics and to sinks."""
