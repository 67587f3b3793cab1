"""What runs live: a detector learned from a healthy valve, one step from sample to judgement."""
