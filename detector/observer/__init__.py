"""The adaptive observer of the source's Chapter 4, and what it needs: samples, velocity, approximators, decision."""
